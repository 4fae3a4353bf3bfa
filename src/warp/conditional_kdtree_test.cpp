#include "warp/conditional_kdtree.h"

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
constexpr FilmTiling kTiling{3, 2, 3};

/// A tree of random splits, three deep.
KdTree::Nodes random_tree(std::uint64_t key) {
  KdTree::Nodes nodes;
  for (std::uint32_t i = 0; i < 7; ++i) {
    const bool inner = i < 3;
    nodes.dim.push_back(inner ? static_cast<std::uint8_t>((i + key) % 3) : KdTree::Nodes::kLeaf);
    nodes.y_split.push_back(inner ? 0.2f + 0.6f * sample_float(key, 2 * i) : 0);
    nodes.z_split.push_back(inner ? 0.2f + 0.6f * sample_float(key, 2 * i + 1) : 0);
  }
  return nodes;
}

ConditionalKdTree example(double uniform = 0.2, const Layout& numbers = Layout::parse("bounce1.lobe+bounce1")) {
  std::array<ConditionalKdTree::Trees, 2> trees;
  for (std::size_t w = 0; w < 2; ++w)
    for (std::uint64_t t = 0; t < kTiling.tiles(); ++t)
      trees[w].push_back(t % 7 == 3 ? KdTree::Nodes{} : random_tree(sample_key(w + 1, t)));
  return ConditionalKdTree(kTiling, trees, uniform, numbers);
}

TEST(FilmTiling, TilesOfOneTilingAreShiftedAgainstThoseOfAnother) {
  EXPECT_EQ(kTiling.tile(0, 0.30f, 0.1f), kTiling.tile(0, 0.01f, 0.4f));
  EXPECT_NE(kTiling.tile(0, 0.34f, 0.1f), kTiling.tile(0, 0.32f, 0.1f));
  EXPECT_EQ(kTiling.tile(1, 0.34f, 0.1f), kTiling.tile(1, 0.32f, 0.1f));
  for (int k = 0; k < kTiling.tilings; ++k)
    for (const float x : {0.0f, 0.5f, std::nextafter(1.0f, 0.0f), 1.0f})
      for (const float y : {0.0f, 0.5f, 1.0f}) EXPECT_LT(kTiling.tile(k, x, y), kTiling.tiles());
}

TEST(ConditionalKdTree, SamplesAndDensitiesAgree) {
  const VertexBuffer vertices = test::random_vertices();
  for (const double uniform : {0.0, 0.2}) {
    const ConditionalKdTree tree = example(uniform);
    for (const auto which : kBoth) {
      const Drawn drawn = draw(tree, which, vertices.view());
      EXPECT_EQ(drawn.inv_q, drawn.inv_q_again);
      double spread = 0;
      for (std::size_t i = 0; i < kVertices; ++i)
        spread += std::fabs(std::log(static_cast<double>(drawn.inv_q[i]))) / kVertices;
      EXPECT_GT(spread, 0.2) << "not uniform";
    }
  }
}

TEST(ConditionalKdTree, WeightedDrawsAreUniform) { test::expect_weighted_draws_are_uniform(example()); }

// Latents that lie evenly: each cell of a grid of y gets as many draws as its density says.
TEST(ConditionalKdTree, DrawsFollowTheDensity) {
  const ConditionalKdTree tree = example();
  constexpr int kSide = 48;  // latents along each axis
  constexpr std::size_t n = kSide * kSide * kSide;
  VertexBuffer buffer;
  std::array<std::vector<double>, 3> z;
  for (std::size_t i = 0; i < n; ++i) {
    Vertex vertex;
    vertex.film = {0.4f, 0.4f};
    vertex.kind = 1;
    buffer.add(vertex);
    z[0].push_back((static_cast<double>(i % kSide) + 0.5) / kSide);
    z[1].push_back((static_cast<double>(i / kSide % kSide) + 0.5) / kSide);
    z[2].push_back((static_cast<double>(i / kSide / kSide) + 0.5) / kSide);
  }
  std::vector<std::uint32_t> places(n * tree.place_size());
  tree.locate(buffer.view(), n, places.data());
  std::array<std::vector<float>, 3> y, grid;
  for (auto* numbers : {&y, &grid})
    for (auto& values : *numbers) values.resize(n);
  std::vector<float> inv_q(n);
  tree.sample(VertexDecision::light_sampling, buffer.view(), places.data(), n, {z[0].data(), z[1].data(), z[2].data()},
              {y[0].data(), y[1].data(), y[2].data()}, inv_q.data());
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t i = 0; i < n; ++i) grid[a][i] = static_cast<float>(z[a][i]);
  tree.inverse_density(VertexDecision::light_sampling, buffer.view(), places.data(), n,
                       {grid[0].data(), grid[1].data(), grid[2].data()}, inv_q.data());
  std::array<double, 8> drawn{}, expected{};
  for (std::size_t i = 0; i < n; ++i) {
    const auto octant = [&](const auto& v) {
      return (v[0][i] >= 0.5f) + 2 * (v[1][i] >= 0.5f) + 4 * (v[2][i] >= 0.5f);
    };
    drawn[static_cast<std::size_t>(octant(y))] += 1.0 / n;
    expected[static_cast<std::size_t>(octant(grid))] += 1.0 / n / static_cast<double>(inv_q[i]);
  }
  // Either is right to about a layer of latents, 1 / 48 of an octant's eighth in each of three directions.
  for (std::size_t o = 0; o < 8; ++o) EXPECT_NEAR(drawn[o], expected[o], 0.008) << o;
  EXPECT_GT(*std::max_element(expected.begin(), expected.end()), 0.16) << "not uniform";
}

TEST(ConditionalKdTree, VerticesDoNotKnowOfEachOther) { test::expect_vertices_do_not_know_of_each_other(example()); }

TEST(ConditionalKdTree, IsTheSameAfterSavingAndLoading) {
  const ConditionalKdTree tree = example(0.1, Layout::parse("bounce2.lobe+bounce2+bounce2.light+bounce2.light_uv"));
  TensorFile file;
  tree.save(file, "warp.");
  const auto loaded = ConditionalKdTree::load(file, "warp.");
  const VertexBuffer vertices = test::random_vertices();
  for (const auto which : kBoth) {
    const Drawn a = draw(tree, which, vertices.view()), b = draw(*loaded, which, vertices.view());
    EXPECT_EQ(a.y, b.y);
    EXPECT_EQ(a.inv_q, b.inv_q);
    EXPECT_TRUE(loaded->warps(which, 2));
    EXPECT_FALSE(loaded->warps(which, 1));
  }
}

TEST(ConditionalKdTree, BrokenFilesAreErrors) {
  const ConditionalKdTree tree = example();
  const auto broken = [&](auto change) {
    TensorFile file;
    tree.save(file, "");
    change(file);
    EXPECT_THROW(ConditionalKdTree::load(file, ""), FileError);
  };
  broken([](TensorFile& file) { file.metadata()["columns"] = "4"; });
  broken([](TensorFile& file) { file.metadata()["rows"] = "many"; });
  broken([](TensorFile& file) { file.metadata()["tilings"] = "9"; });
  broken([](TensorFile& file) { file.metadata()["numbers"] = "bounce1"; });
  const auto broken_number = [&]<class T>(const char* name, std::size_t at, T value) {
    broken([&](TensorFile& file) {
      auto tensor = file.get<T>(name);
      tensor.values[at] = value;
      file.put<T>(name, tensor.shape, tensor.values);
    });
  };
  broken_number("uniform", 0, 1.0f);
  broken_number("light.y_split", 0, 1.0f);
  broken_number("light.z_split", 1, std::nanf(""));
  broken_number("scatter.dim", 0, std::uint8_t{3});
  broken_number("scatter.dim", 0, KdTree::Nodes::kLeaf);
  broken_number("scatter.sizes", 0, std::int32_t{-7});
  broken_number("scatter.sizes", 0, std::int32_t{5});
}

}  // namespace
}  // namespace warpath
