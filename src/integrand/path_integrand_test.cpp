#include "integrand/path_integrand.h"

#include <gtest/gtest.h>

#include "tracer/test_scene.h"

namespace warpath {
namespace {

using testing::facing;
using testing::make_rectangle;
using testing::SceneBuilder;

std::shared_ptr<const Tracer> room() {
  SceneBuilder b;
  b.box(b.diffuse(Color(0.7f, 0.5f, 0.3f)));
  b.light(make_rectangle(facing({0, 0.99f, 0}, {0, -1, 0}, 0.3f)), Color(5.0f));
  b.look({0, 0, 0.9f}, {0, 0, -1}, {0, 1, 0}, 70);
  return std::make_shared<const Tracer>(std::move(b.scene));
}

TEST(PathIntegrand, MeanOverUniformYIsThatOfTheTracer) {
  const auto tracer = room();
  const auto plain = testing::estimate(*tracer, 1, 200000);
  for (const char* names : {"film+bounce1", "bounce1.lobe+bounce1", "film+bounce1.light_uv+bounce2"}) {
    const PathIntegrand f(tracer, Layout::parse(names), 2);
    const std::size_t n = 200000, d = static_cast<std::size_t>(f.dims());
    Matrix<double> y(n, d), value(n, 3);
    const auto ids = testing::make_ids(0, n);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < d; ++k) y(i, k) = sample_double(sample_key(3, i), static_cast<std::uint32_t>(k));
    f.evaluate(y.batch(), ids, value.batch());
    for (std::size_t c = 0; c < 3; ++c) {
      double sum = 0, squares = 0;
      for (std::size_t i = 0; i < n; ++i) sum += value(i, c), squares += value(i, c) * value(i, c);
      const double mean = sum / n, error = std::sqrt((squares / n - mean * mean) / n);
      EXPECT_NEAR(mean, plain.mean[c], 4.5 * std::hypot(error, plain.error[c])) << names;
    }
  }
}

TEST(PathIntegrand, SameYSameIdSameValueInAnyBatch) {
  const PathIntegrand f(room(), Layout::parse("film+bounce1"), 2);
  const std::size_t n = 5000;
  Matrix<double> y(n, 4), whole(n, 3), single(1, 3);
  const auto ids = testing::make_ids(77, n);
  for (std::size_t i = 0; i < n; ++i)
    for (std::uint32_t k = 0; k < 4; ++k) y(i, k) = sample_double(sample_key(3, i), k);
  f.evaluate(y.batch(), ids, whole.batch());
  for (std::size_t i = 0; i < n; i += 97) {
    f.evaluate(Batch<const double>(y.batch()).rows_from(i, 1), std::span(ids).subspan(i, 1), single.batch());
    for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(single(0, c), whole(i, c));
  }
}

}  // namespace
}  // namespace warpath
