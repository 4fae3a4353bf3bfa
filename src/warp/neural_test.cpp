#include "warp/neural.h"

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

/// A network of random weights over a field that knows half of the materials.
Neural example(int light_parts, const Layout& numbers = {}) {
  auto network = std::make_shared<const VertexNetwork>(light_parts, NeuralShape{});
  auto parameters = network->initial(3);
  for (std::size_t i = network->first_of_head(0); i < parameters.size(); ++i)
    parameters[i] = 0.2f * (2 * sample_float(17, static_cast<std::uint32_t>(i)) - 1);
  auto field = std::make_shared<Field>(test::random_field(test::random_vertices().view(), light_parts));
  return Neural(std::move(field), std::move(network), {{0.1f, 0, 0}, 0.9f}, std::move(parameters), numbers);
}

TEST(Neural, SamplesAndDensitiesAgree) {
  const VertexContextBuffer vertices = test::random_vertices();
  for (const int parts : {1, 3, 93, 1000}) {
    const Neural neural = example(parts);
    for (const auto which : {VertexNumbers::light, VertexNumbers::scatter}) {
      const Drawn drawn = draw(neural, which, vertices.view());
      double spread = 0;
      for (std::size_t i = 0; i < kVertices; ++i) {
        EXPECT_NEAR(static_cast<double>(drawn.inv_q[i]) / static_cast<double>(drawn.inv_q_again[i]), 1, 1e-4);
        spread += std::fabs(std::log(static_cast<double>(drawn.inv_q[i]))) / kVertices;
      }
      EXPECT_GT(spread, 0.1) << "not uniform";
    }
  }
}

TEST(Neural, VerticesDoNotKnowOfEachOther) { test::expect_vertices_do_not_know_of_each_other(example(3)); }

TEST(Neural, IsTheSameAfterSavingAndLoading) {
  const Layout numbers = Layout::parse("bounce1.lobe+bounce1+bounce2.light+bounce2.light_uv");
  const Neural neural = example(5, numbers);
  TensorFile file;
  neural.save(file, "warp.");
  const auto loaded = Neural::load(file, "warp.");
  const VertexContextBuffer vertices = test::random_vertices();
  for (const auto which : {VertexNumbers::light, VertexNumbers::scatter}) {
    const Drawn a = draw(neural, which, vertices.view()), b = draw(*loaded, which, vertices.view());
    EXPECT_EQ(a.y, b.y);
    EXPECT_EQ(a.inv_q, b.inv_q);
    for (const std::uint16_t bounce : {1, 2, 3})
      EXPECT_EQ(loaded->warps(which, bounce), bounce == (which == VertexNumbers::scatter ? 1 : 2));
  }
}

TEST(Neural, BrokenFilesAreErrors) {
  const Neural neural = example(5);
  const auto broken = [&](auto change) {
    TensorFile file;
    neural.save(file, "");
    change(file);
    EXPECT_THROW(Neural::load(file, ""), FileError);
  };
  broken([](TensorFile& file) { file.metadata()["width"] = "17"; });
  broken([](TensorFile& file) { file.metadata()["width"] = "64"; });
  broken([](TensorFile& file) { file.metadata()["blocks"] = "many"; });
  broken([](TensorFile& file) { file.metadata()["numbers"] = "bounce1"; });
  broken([](TensorFile& file) { file.metadata()["numbers"] = "bonce1"; });
  broken([](TensorFile& file) { file.metadata()["field.light_parts"] = "many"; });
  broken([](TensorFile& file) {
    auto weights = file.get<float>("network");
    weights.values[5] = std::nanf("");
    file.put<float>("network", weights.shape, weights.values);
  });
  broken([](TensorFile& file) {
    const std::vector<float> few(3);
    file.put<float>("box", {3}, few);
  });
}

TEST(Neural, NumbersAreDrawnWhole) {
  for (const char* numbers :
       {"bounce1.lobe+bounce1", "bounce2.light_uv+bounce2.light", "bounce1.lobe+bounce1+bounce3.lobe+bounce3"})
    EXPECT_NO_THROW(check_vertex_numbers(Layout::parse(numbers))) << numbers;
  for (const char* numbers :
       {"bounce1", "bounce1.lobe", "film+bounce1.lobe+bounce1", "bounce1.rr", "bounce1.light", "bounce1.lobe+bounce2"})
    EXPECT_THROW(check_vertex_numbers(Layout::parse(numbers)), ConfigError) << numbers;
}

}  // namespace
}  // namespace warpath
