#include "warp/field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/tensor_file.h"
#include "warp/vertex_proposal_fixture.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using test::draw, test::Drawn, test::kVertices;

bool known(const VertexContext& vertices, std::size_t i) { return vertices.material[i] < test::kKnownMaterials; }

TEST(Field, FindsTheCellsOfVertices) {
  const VertexBuffer vertices = test::random_vertices();
  const Field field = test::random_field(vertices.view(), 3);
  const Drawn drawn = draw(field, VertexDecision::light_sampling, vertices.view());
  for (std::size_t i = 0; i < kVertices; ++i) {
    const auto cell =
        field.tree().cell(FieldTree::root_key(vertices.view(), i), FieldTree::features(vertices.view(), i));
    EXPECT_EQ(drawn.places[i], cell);
    EXPECT_EQ(cell != FieldTree::kNoCell, known(vertices.view(), i));
  }
}

TEST(Field, SamplesAndDensitiesAgree) {
  const VertexBuffer vertices = test::random_vertices();
  for (const int parts : {1, 3, 93, 1000}) {
    const Field field = test::random_field(vertices.view(), parts);
    for (const auto which : {VertexDecision::light_sampling, VertexDecision::scattering}) {
      const Drawn drawn = draw(field, which, vertices.view());
      std::size_t plain = 0;
      for (std::size_t i = 0; i < kVertices; ++i) {
        EXPECT_NEAR(drawn.inv_q[i] / drawn.inv_q_again[i], 1, 1e-4);
        if (known(vertices.view(), i))
          plain += drawn.inv_q[i] == 1;
        else
          EXPECT_EQ(drawn.inv_q[i], 1);
      }
      EXPECT_LT(plain, kVertices / 20);
    }
  }
}

/// What a field expects back for numbers that it has drawn.
std::vector<float> expected_returns(const Field& field, const Drawn& drawn) {
  std::vector<float> expected(kVertices);
  EXPECT_TRUE(field.expect_return(drawn.places.data(), kVertices, drawn.inv_q.data(), expected.data()));
  return expected;
}

TEST(Field, WhatIsExpectedBackIsTheMeanOfTheCellOnAverage) {
  const VertexBuffer vertices = test::random_vertices();
  const Field field = test::random_field(vertices.view(), 3);
  const auto expected = expected_returns(field, draw(field, VertexDecision::scattering, vertices.view()));
  double n = 0, sum = 0, square = 0;
  for (std::size_t i = 0; i < kVertices; ++i) {
    if (!known(vertices.view(), i)) {
      EXPECT_EQ(expected[i], HUGE_VALF);
      continue;
    }
    n += 1, sum += expected[i], square += expected[i] * expected[i];
  }
  const double mean = sum / n, variance = square / n - mean * mean;
  EXPECT_GT(variance, 0.001 * mean * mean);
  // 4.5 standard errors: one false alarm in 147,000 choices of seeds.
  EXPECT_NEAR(mean, test::kMeanReturn, 4.5 * std::sqrt(variance / n));
}

TEST(Field, IsTheSameAfterSavingAndLoading) {
  const VertexBuffer vertices = test::random_vertices();
  const Field field = test::random_field(vertices.view(), 5);
  TensorFile file;
  field.save(file, "warp.");
  const auto loaded = Field::load(file, "warp.");
  for (const auto which : {VertexDecision::light_sampling, VertexDecision::scattering}) {
    const Drawn a = draw(field, which, vertices.view()), b = draw(*loaded, which, vertices.view());
    EXPECT_EQ(a.y, b.y);
    EXPECT_EQ(a.inv_q, b.inv_q);
    if (which == VertexDecision::scattering) {
      EXPECT_EQ(expected_returns(field, a), expected_returns(*loaded, b));
    }
  }
}

TEST(Field, BrokenFilesAreErrors) {
  const Field field = test::random_field(test::random_vertices().view(), 5);
  const auto broken = [&](auto change) {
    TensorFile file;
    field.save(file, "");
    change(file);
    EXPECT_THROW(Field::load(file, ""), FileError);
  };
  broken([](TensorFile& file) { file.metadata()["light_parts"] = "many"; });
  broken([](TensorFile& file) { file.metadata()["light_parts"] = "400"; });
  broken([](TensorFile& file) {
    auto nodes = file.get<std::int32_t>("nodes");
    nodes.values[1] = 0;  // a root that is its own child
    file.put<std::int32_t>("nodes", nodes.shape, nodes.values);
  });
  broken([](TensorFile& file) {
    auto light = file.get<std::int32_t>("light");
    light.values[7] = kWholeProbability + 1;
    file.put<std::int32_t>("light", light.shape, light.values);
  });
  broken([](TensorFile& file) {
    auto returns = file.get<float>("returns");
    returns.values[3] = -1;
    file.put<float>("returns", returns.shape, returns.values);
  });
  broken([](TensorFile& file) {
    const std::vector<float> few(4);
    file.put<float>("returns", {1, 4}, few);
  });
  broken([](TensorFile& file) {
    const std::vector<std::uint8_t> few(3);
    file.put<std::uint8_t>("kinds", {3}, few);
  });
}

TEST(FieldTree, CellsAreWhereTheSplitsPutThem) {
  FieldTree tree;
  EXPECT_EQ(tree.cell(4, {}), FieldTree::kNoCell);
  const std::uint32_t root = tree.add_root(4);
  const std::uint32_t right = tree.split(root, 0, 0.5f), top = tree.split(right, 1, 2.0f);
  EXPECT_EQ(tree.cells(), 3u);
  EXPECT_EQ(tree.cell(4, {0.4f, 9}), root);
  EXPECT_EQ(tree.cell(4, {0.5f, 1}), right);
  EXPECT_EQ(tree.cell(4, {0.5f, 2}), top);
  EXPECT_EQ(tree.cell(3, {0.5f, 2}), FieldTree::kNoCell);
}

}  // namespace
}  // namespace warpath
