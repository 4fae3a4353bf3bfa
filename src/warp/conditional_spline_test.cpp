#include "warp/conditional_spline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/rng.h"
#include "core/tensor_file.h"
#include "warp/vertex_warp_fixture.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using test::draw, test::Drawn, test::kVertices;

constexpr std::array kBoth{VertexNumbers::light, VertexNumbers::scatter};

/// Flows of random weights.
ConditionalSpline example(double uniform = 0.2, const Layout& numbers = Layout::parse("bounce1.lobe+bounce1")) {
  const ConditionalSplineSettings settings;
  const auto shape = std::make_shared<const ConditionalSpline::Shape>(settings.flow, 3, 5);
  std::array<nn::AlignedVector<float>, 2> parameters;
  std::uint32_t n = 0;
  for (auto& p : parameters) {
    p = shape->flow.initial(1);
    for (const ParameterView& view : shape->flow.views())
      for (std::size_t r = 0; r < view.rows; ++r)
        for (std::size_t c = 0; c < view.cols; ++c)
          p[view.offset + r * view.stride + c] = 0.5f * (2 * sample_float(17, n++) - 1);
  }
  return ConditionalSpline(shape, {{0.1f, 0, 0}, 0.9f}, std::move(parameters), uniform, numbers);
}

TEST(ConditionalSpline, SamplesAndDensitiesAgree) {
  const VertexContextBuffer vertices = test::random_vertices();
  for (const double uniform : {0.0, 0.2}) {
    const ConditionalSpline spline = example(uniform);
    for (const auto which : kBoth) {
      const Drawn drawn = draw(spline, which, vertices.view());
      double spread = 0;
      for (std::size_t i = 0; i < kVertices; ++i) {
        EXPECT_NEAR(static_cast<double>(drawn.inv_q[i]) / static_cast<double>(drawn.inv_q_again[i]), 1, 1e-3);
        if (uniform > 0) {
          EXPECT_LE(static_cast<double>(drawn.inv_q[i]), 1 / uniform * (1 + 1e-6));
        }
        spread += std::fabs(std::log(static_cast<double>(drawn.inv_q[i]))) / kVertices;
      }
      EXPECT_GT(spread, 0.2) << "not uniform";
    }
  }
}

// E[1 / q] = 1, and the mean of a function of the numbers is that under uniform numbers: 4.5 standard errors each, a
// false alarm in 18,000 choices of numbers. The share of uniform numbers bounds 1 / q.
TEST(ConditionalSpline, WeightedDrawsAreUniform) {
  const VertexContextBuffer vertices = test::random_vertices();
  const ConditionalSpline spline = example();
  for (const auto which : kBoth) {
    const Drawn drawn = draw(spline, which, vertices.view());
    const auto expect_mean = [&](double expected, const auto& value) {
      double sum = 0, square = 0;
      for (std::size_t i = 0; i < kVertices; ++i) {
        const double v = static_cast<double>(drawn.inv_q[i]) * value(i);
        sum += v / kVertices;
        square += v * v / kVertices;
      }
      EXPECT_NEAR(sum, expected, 4.5 * std::sqrt((square - sum * sum) / kVertices));
    };
    expect_mean(1, [](std::size_t) { return 1.0; });
    for (std::size_t a = 0; a < 3; ++a)
      expect_mean(0.5, [&](std::size_t i) { return static_cast<double>(drawn.y[a][i]); });
    expect_mean(0.125,
                [&](std::size_t i) { return static_cast<double>(drawn.y[0][i] * drawn.y[1][i] * drawn.y[2][i]); });
  }
}

// What is drawn at a vertex must not depend on which others are in its batch.
TEST(ConditionalSpline, VerticesDoNotKnowOfEachOther) {
  const ConditionalSpline spline = example();
  const VertexContextBuffer vertices = test::random_vertices();
  for (const auto which : kBoth) {
    const Drawn all = draw(spline, which, vertices.view()), rest = draw(spline, which, vertices.view(), 77);
    for (std::size_t i = 77; i < kVertices; ++i) {
      ASSERT_EQ(all.inv_q[i], rest.inv_q[i - 77]);
      for (std::size_t a = 0; a < 3; ++a) ASSERT_EQ(all.y[a][i], rest.y[a][i - 77]);
    }
  }
}

TEST(ConditionalSpline, SeesTheFilm) {
  const ConditionalSpline spline = example();
  VertexContextBuffer here, there;
  VertexValues values{};
  for (std::size_t i = 0; i < kVertices; ++i) {
    values[13] = 0.2f;
    here.add(values, 1, 0);
    values[13] = 0.7f;
    there.add(values, 1, 0);
  }
  const Drawn a = draw(spline, VertexNumbers::light, here.view()), b = draw(spline, VertexNumbers::light, there.view());
  EXPECT_NE(a.y, b.y);
}

TEST(ConditionalSpline, IsTheSameAfterSavingAndLoading) {
  const ConditionalSpline spline = example(0.25, Layout::parse("bounce1.lobe+bounce1+bounce2.light+bounce2.light_uv"));
  TensorFile file;
  spline.save(file, "warp.");
  const auto loaded = ConditionalSpline::load(file, "warp.");
  const VertexContextBuffer vertices = test::random_vertices();
  for (const auto which : kBoth) {
    const Drawn a = draw(spline, which, vertices.view()), b = draw(*loaded, which, vertices.view());
    EXPECT_EQ(a.y, b.y);
    EXPECT_EQ(a.inv_q, b.inv_q);
    for (const std::uint16_t bounce : {1, 2, 3})
      EXPECT_EQ(loaded->warps(which, bounce), bounce == (which == VertexNumbers::scatter ? 1 : 2));
  }
}

TEST(ConditionalSpline, BrokenFilesAreErrors) {
  const ConditionalSpline spline = example();
  const auto broken = [&](auto change) {
    TensorFile file;
    spline.save(file, "");
    change(file);
    EXPECT_THROW(ConditionalSpline::load(file, ""), FileError);
  };
  broken([](TensorFile& file) { file.metadata()["width"] = "17"; });
  broken([](TensorFile& file) { file.metadata()["width"] = "64"; });
  broken([](TensorFile& file) { file.metadata()["film_bins"] = "many"; });
  broken([](TensorFile& file) { file.metadata()["position_bins"] = "7"; });
  broken([](TensorFile& file) { file.metadata()["numbers"] = "bounce1"; });
  const auto broken_tensor = [&](const char* name, std::size_t at, float value) {
    broken([&](TensorFile& file) {
      auto tensor = file.get<float>(name);
      tensor.values[at] = value;
      file.put<float>(name, tensor.shape, tensor.values);
    });
  };
  broken_tensor("box_and_uniform", 4, 1.0f);
  broken_tensor("box_and_uniform", 4, -0.1f);
  broken_tensor("box_and_uniform", 0, std::nanf(""));
  broken_tensor("scatter.coupling0.layer0.weight", 5, std::nanf(""));
}

}  // namespace
}  // namespace warpath
