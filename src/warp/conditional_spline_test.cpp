#include "warp/conditional_spline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/rng.h"
#include "core/tensor_file.h"
#include "warp/vertex_proposal_fixture.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using test::draw, test::Drawn, test::kVertices;

constexpr std::array kBoth{VertexDecision::light_sampling, VertexDecision::scattering};

/// Flows of random weights.
ConditionalSpline example(double uniform = 0.2, const Layout& numbers = Layout::parse("bounce1.lobe+bounce1")) {
  SplineSettings settings;
  settings.masks = SplineSettings::Masks::autoregressive;
  settings.couplings = 1;
  const auto shape = std::make_shared<const ConditionalSpline::Shape>(settings, 3, 5);
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
  const VertexBuffer vertices = test::random_vertices();
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

TEST(ConditionalSpline, WeightedDrawsAreUniform) { test::expect_weighted_draws_are_uniform(example()); }

TEST(ConditionalSpline, VerticesDoNotKnowOfEachOther) { test::expect_vertices_do_not_know_of_each_other(example()); }

TEST(ConditionalSpline, SeesTheFilm) {
  const ConditionalSpline spline = example();
  VertexBuffer here, there;
  Vertex vertex;
  vertex.kind = 1;
  for (std::size_t i = 0; i < kVertices; ++i) {
    vertex.film[0] = 0.2f;
    here.add(vertex);
    vertex.film[0] = 0.7f;
    there.add(vertex);
  }
  const Drawn a = draw(spline, VertexDecision::light_sampling, here.view()),
              b = draw(spline, VertexDecision::light_sampling, there.view());
  EXPECT_NE(a.y, b.y);
}

TEST(ConditionalSpline, IsTheSameAfterSavingAndLoading) {
  const ConditionalSpline spline = example(0.25, Layout::parse("bounce1.lobe+bounce1+bounce2.light+bounce2.light_uv"));
  TensorFile file;
  spline.save(file, "warp.");
  const auto loaded = ConditionalSpline::load(file, "warp.");
  const VertexBuffer vertices = test::random_vertices();
  for (const auto which : kBoth) {
    const Drawn a = draw(spline, which, vertices.view()), b = draw(*loaded, which, vertices.view());
    EXPECT_EQ(a.y, b.y);
    EXPECT_EQ(a.inv_q, b.inv_q);
    for (const std::uint16_t bounce : {1, 2, 3})
      EXPECT_EQ(loaded->warps(which, bounce), bounce == (which == VertexDecision::scattering ? 1 : 2));
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
