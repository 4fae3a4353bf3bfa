#include "warp/field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/rng.h"
#include "core/tensor_file.h"
#include "warpath/error.h"

namespace warpath {
namespace {

/// Vertices at random places of a cube, on three materials and all six sides.
struct Vertices {
  explicit Vertices(std::size_t n) {
    for (auto& values : context) values.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint64_t key = sample_key(11, i);
      for (std::uint32_t k = 0; k < 3; ++k) context[k][i] = sample_float(key, k);
      context[3 + i % 3][i] = i % 2 ? 1.0f : -1.0f;
      for (std::uint32_t k = 6; k < 9; ++k) context[k][i] = 2 * sample_float(key, k) - 1;
      material.push_back(static_cast<std::uint32_t>(i / 6 % 3));
      kind.push_back(static_cast<std::uint8_t>(material.back() == 0   ? SurfaceKind::diffuse
                                               : material.back() == 1 ? SurfaceKind::mixed
                                                                      : SurfaceKind::delta));
    }
  }
  VertexContext view() const {
    VertexContext v;
    for (std::size_t k = 0; k < 3; ++k) {
      v.position[k] = context[k].data();
      v.normal[k] = context[3 + k].data();
      v.wi[k] = context[6 + k].data();
    }
    v.kind = kind.data();
    v.material = material.data();
    return v;
  }
  std::array<std::vector<float>, 9> context;
  std::vector<std::uint32_t> material;
  std::vector<std::uint8_t> kind;
};

constexpr std::size_t kVertices = 3000;
constexpr float kMeanReturn = 3;

/// A field with a cut tree for the first two materials, and random densities.
Field example(const Vertices& vertices, int light_parts) {
  FieldTree tree;
  std::vector<SurfaceKind> kinds;
  const VertexContext view = vertices.view();
  for (std::size_t i = 0; i < kVertices; ++i) {
    const std::uint32_t key = FieldTree::root_key(view, i);
    if (vertices.material[i] == 2 || tree.cell(key, FieldTree::features(view, i)) != FieldTree::kNoCell) continue;
    std::uint32_t cell = tree.add_root(key);
    kinds.push_back(FieldTree::kind_of(key));
    for (const std::size_t feature : {0, 2, 7}) {
      cell = tree.split(cell, feature % FieldTree::kFeatures, 0.5f);
      kinds.push_back(FieldTree::kind_of(key));
    }
  }
  const FieldGrids grids(light_parts);
  std::vector<CumulativeProbability> light(tree.cells() * grids.light.stored());
  std::vector<CumulativeProbability> scatter(tree.cells() * grids.diffuse.stored());
  std::vector<Field::Returns> returns;
  for (std::uint32_t c = 0; c < tree.cells(); ++c) {
    // The least density is a sixth.
    returns.push_back({{1, 0.5f}, {kMeanReturn, 0.85f}});
    const auto fill = [&](const HalvingGrid& grid, std::vector<CumulativeProbability>& densities) {
      std::vector<float> mass(grid.bins());
      for (std::uint32_t b = 0; b < grid.bins(); ++b)
        mass[b] = grid.volume(b) * (0.1f + sample_float(sample_key(13, c), b));
      grid.set_density(mass, densities.data() + c * grid.stored());
    };
    fill(grids.light, light);
    fill(grids.grid(VertexNumbers::scatter, kinds[c]), scatter);
  }
  return Field(std::move(tree), grids, std::move(kinds), std::move(light), std::move(scatter), std::move(returns));
}

struct Drawn {
  std::array<std::vector<float>, 3> y;
  std::vector<float> inv_q, inv_q_again;
};
Drawn draw(const Field& field, VertexNumbers which, const Vertices& vertices) {
  std::array<std::vector<double>, 3> z;
  Drawn drawn;
  for (std::uint32_t a = 0; a < 3; ++a) {
    drawn.y[a].resize(kVertices);
    for (std::size_t i = 0; i < kVertices; ++i) z[a].push_back(sample_double(sample_key(17, i), a));
  }
  std::vector<std::uint32_t> places(kVertices);
  field.locate(vertices.view(), kVertices, places.data());
  for (std::size_t i = 0; i < kVertices; ++i)
    EXPECT_EQ(places[i],
              field.tree().cell(FieldTree::root_key(vertices.view(), i), FieldTree::features(vertices.view(), i)));
  drawn.inv_q.resize(kVertices);
  drawn.inv_q_again.resize(kVertices);
  field.sample(which, vertices.view(), places.data(), kVertices, {z[0].data(), z[1].data(), z[2].data()},
               {drawn.y[0].data(), drawn.y[1].data(), drawn.y[2].data()}, drawn.inv_q.data());
  field.inverse_density(which, vertices.view(), places.data(), kVertices,
                        {drawn.y[0].data(), drawn.y[1].data(), drawn.y[2].data()}, drawn.inv_q_again.data());
  return drawn;
}

TEST(Field, SamplesAndDensitiesAgree) {
  const Vertices vertices(kVertices);
  for (const int parts : {1, 3, 93, 1000}) {
    const Field field = example(vertices, parts);
    for (const auto which : {VertexNumbers::light, VertexNumbers::scatter}) {
      const Drawn drawn = draw(field, which, vertices);
      std::size_t plain = 0;
      for (std::size_t i = 0; i < kVertices; ++i) {
        EXPECT_NEAR(drawn.inv_q[i] / drawn.inv_q_again[i], 1, 1e-4);
        // The third material is in no cell.
        if (vertices.material[i] == 2)
          EXPECT_EQ(drawn.inv_q[i], 1);
        else
          plain += drawn.inv_q[i] == 1;
      }
      EXPECT_LT(plain, kVertices / 20);
    }
  }
}

/// What a field expects back for numbers that it has drawn.
std::vector<float> expected_returns(const Field& field, const Vertices& vertices, const Drawn& drawn) {
  std::vector<std::uint32_t> places(kVertices);
  field.locate(vertices.view(), kVertices, places.data());
  std::vector<float> expected(kVertices);
  EXPECT_TRUE(field.expect_return(places.data(), kVertices, drawn.inv_q.data(), expected.data()));
  return expected;
}

TEST(Field, WhatIsExpectedBackIsTheMeanOfTheCellOnAverage) {
  const Vertices vertices(kVertices);
  const Field field = example(vertices, 3);
  const auto expected = expected_returns(field, vertices, draw(field, VertexNumbers::scatter, vertices));
  double n = 0, sum = 0, square = 0;
  for (std::size_t i = 0; i < kVertices; ++i) {
    if (vertices.material[i] == 2) {
      EXPECT_EQ(expected[i], HUGE_VALF);
      continue;
    }
    n += 1, sum += expected[i], square += expected[i] * expected[i];
  }
  const double mean = sum / n, variance = square / n - mean * mean;
  EXPECT_GT(variance, 0.001 * mean * mean);
  // 4.5 standard errors: one false alarm in 147,000 choices of seeds.
  EXPECT_NEAR(mean, kMeanReturn, 4.5 * std::sqrt(variance / n));
}

TEST(Field, IsTheSameAfterSavingAndLoading) {
  const Vertices vertices(kVertices);
  const Field field = example(vertices, 5);
  TensorFile file;
  field.save(file, "warp.");
  const auto loaded = Field::load(file, "warp.");
  for (const auto which : {VertexNumbers::light, VertexNumbers::scatter}) {
    const Drawn a = draw(field, which, vertices), b = draw(*loaded, which, vertices);
    EXPECT_EQ(a.y, b.y);
    EXPECT_EQ(a.inv_q, b.inv_q);
    if (which == VertexNumbers::scatter) {
      EXPECT_EQ(expected_returns(field, vertices, a), expected_returns(*loaded, vertices, b));
    }
  }
}

TEST(Field, BrokenFilesAreErrors) {
  const Field field = example(Vertices(kVertices), 5);
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
