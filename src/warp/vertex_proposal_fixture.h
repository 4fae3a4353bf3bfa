#pragma once
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/rng.h"
#include "path/vertex.h"
#include "warp/field.h"

// Vertices, a field over them, and draws: for the tests of warps at vertices.
namespace warpath::test {

constexpr std::size_t kVertices = 3001;  // no multiple of a block
/// Materials that the field below knows; the others are in no cell.
constexpr std::uint32_t kKnownMaterials = 2;
constexpr float kMeanReturn = 3;

/// Vertices at random places of a cube, on its six sides, of four materials: diffuse, mixed, delta and glossy.
inline VertexBuffer random_vertices() {
  constexpr std::array kinds{SurfaceKind::diffuse, SurfaceKind::mixed, SurfaceKind::delta, SurfaceKind::glossy};
  VertexBuffer vertices;
  for (std::size_t i = 0; i < kVertices; ++i) {
    const auto number = [i](std::size_t k) { return sample_float(sample_key(11, i), static_cast<std::uint32_t>(k)); };
    Vertex vertex;
    for (std::size_t k = 0; k < 3; ++k) {
      vertex.position[k] = number(k);
      vertex.wi[k] = 2 * number(6 + k) - 1;
      vertex.albedo[k] = number(9 + k);
    }
    vertex.normal[i % 3] = i % 2 ? 1.0f : -1.0f;
    vertex.roughness = number(12);
    vertex.film = {number(13), number(14)};
    vertex.material = static_cast<std::uint32_t>(i / 6 % kinds.size());
    vertex.kind = static_cast<std::uint8_t>(kinds[vertex.material]);
    vertices.add(vertex);
  }
  return vertices;
}

/// A field with a cut tree for the known materials, and random densities, of which the least is a sixth.
inline Field random_field(const VertexContext& vertices, int light_parts) {
  FieldTree tree;
  std::vector<SurfaceKind> kinds;
  for (std::size_t i = 0; i < kVertices; ++i) {
    const std::uint32_t key = FieldTree::root_key(vertices, i);
    if (vertices.material[i] >= kKnownMaterials ||
        tree.cell(key, FieldTree::features(vertices, i)) != FieldTree::kNoCell)
      continue;
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
  for (std::uint32_t c = 0; c < tree.cells(); ++c) {
    const auto fill = [&](const HalvingGrid& grid, std::vector<CumulativeProbability>& densities) {
      std::vector<float> mass(grid.bins());
      for (std::uint32_t b = 0; b < grid.bins(); ++b)
        mass[b] = grid.volume(b) * (0.1f + sample_float(sample_key(13, c), b));
      grid.set_density(mass, densities.data() + c * grid.stored());
    };
    fill(grids.light, light);
    fill(grids.grid(VertexDecision::scattering, kinds[c]), scatter);
  }
  std::vector<Field::Returns> returns(tree.cells(), {{1, 0.5f}, {kMeanReturn, 0.85f}});
  return Field(std::move(tree), grids, std::move(kinds), std::move(light), std::move(scatter), std::move(returns));
}

struct Drawn {
  std::array<std::vector<float>, 3> y;
  std::vector<float> inv_q, inv_q_again;  ///< of the draws, and of the density of what was drawn
  std::vector<std::uint32_t> places;
};

/// Draws numbers at the vertices from `from` on.
inline Drawn draw(const VertexProposal& warp, VertexDecision which, const VertexContext& vertices,
                  std::size_t from = 0) {
  const VertexContext context = vertices.from(from);
  const std::size_t n = kVertices - from;
  std::array<std::vector<double>, 3> z;
  Drawn drawn;
  for (std::uint32_t a = 0; a < 3; ++a) {
    drawn.y[a].resize(n);
    for (std::size_t i = 0; i < n; ++i) z[a].push_back(sample_double(sample_key(19, from + i), a));
  }
  drawn.inv_q.resize(n), drawn.inv_q_again.resize(n);
  drawn.places.resize(n * warp.place_size());
  warp.locate(context, n, drawn.places.data());
  const std::array<float*, 3> y{drawn.y[0].data(), drawn.y[1].data(), drawn.y[2].data()};
  warp.sample(which, context, drawn.places.data(), n, {z[0].data(), z[1].data(), z[2].data()}, y, drawn.inv_q.data());
  warp.inverse_density(which, context, drawn.places.data(), n, {y[0], y[1], y[2]}, drawn.inv_q_again.data());
  return drawn;
}

/// What is drawn at a vertex must not depend on which others are in its batch.
inline void expect_vertices_do_not_know_of_each_other(const VertexProposal& warp) {
  const VertexBuffer vertices = random_vertices();
  for (const auto which : {VertexDecision::light_sampling, VertexDecision::scattering}) {
    const Drawn all = draw(warp, which, vertices.view()), rest = draw(warp, which, vertices.view(), 77);
    for (std::size_t i = 77; i < kVertices; ++i) {
      ASSERT_EQ(all.inv_q[i], rest.inv_q[i - 77]);
      for (std::size_t a = 0; a < 3; ++a) ASSERT_EQ(all.y[a][i], rest.y[a][i - 77]);
    }
  }
}

/// E[1 / q] = 1, and the mean of a function of the numbers is that under uniform numbers: 4.5 standard errors each, a
/// false alarm in 147,000 / 10 choices of numbers. 1 / q must be bounded.
inline void expect_weighted_draws_are_uniform(const VertexProposal& warp) {
  const VertexBuffer vertices = random_vertices();
  for (const auto which : {VertexDecision::light_sampling, VertexDecision::scattering}) {
    const Drawn drawn = draw(warp, which, vertices.view());
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

}  // namespace warpath::test
