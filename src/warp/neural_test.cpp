#include "warp/neural.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/rng.h"
#include "core/tensor_file.h"
#include "core/vertex_context_buffer.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::size_t kVertices = 1000;  // no multiple of a block

/// Vertices at random places of a cube, of all kinds of surface.
VertexContextBuffer vertices() {
  VertexContextBuffer buffer;
  for (std::size_t i = 0; i < kVertices; ++i) {
    const std::uint64_t key = sample_key(11, i);
    std::array<float, 13> values;
    for (std::uint32_t k = 0; k < values.size(); ++k) values[k] = sample_float(key, k);
    for (std::size_t k = 3; k < 6; ++k) values[k] = 0;
    values[3 + i % 3] = i % 2 ? 1.0f : -1.0f;
    constexpr std::array kinds{SurfaceKind::diffuse, SurfaceKind::mixed, SurfaceKind::delta, SurfaceKind::glossy};
    buffer.add(values, static_cast<std::uint8_t>(kinds[i % 4]), static_cast<std::uint32_t>(i % 4));
  }
  return buffer;
}

/// A network of random weights over a field that knows half of the materials.
Neural example(int light_parts, const Layout& numbers = {}) {
  const VertexContextBuffer buffer = vertices();
  FieldTree tree;
  std::vector<SurfaceKind> kinds;
  for (std::size_t i = 0; i < kVertices; ++i) {
    const std::uint32_t key = FieldTree::root_key(buffer.view(), i);
    if (i % 4 > 1 || tree.cell(key, FieldTree::features(buffer.view(), i)) != FieldTree::kNoCell) continue;
    tree.add_root(key);
    kinds.push_back(FieldTree::kind_of(key));
  }
  const FieldGrids grids(light_parts);
  std::vector<CumulativeProbability> light(tree.cells() * grids.light.stored());
  std::vector<CumulativeProbability> scatter(tree.cells() * grids.diffuse.stored());
  std::vector<Field::Returns> returns(tree.cells());
  for (std::uint32_t c = 0; c < tree.cells(); ++c) {
    const auto fill = [&](const HalvingGrid& grid, std::vector<CumulativeProbability>& densities) {
      std::vector<float> mass(grid.bins());
      for (std::uint32_t b = 0; b < grid.bins(); ++b)
        mass[b] = grid.volume(b) * (0.1f + sample_float(sample_key(13, c), b));
      grid.set_density(mass, densities.data() + c * grid.stored());
    };
    fill(grids.light, light);
    fill(grids.grid(VertexNumbers::scatter, kinds[c]), scatter);
  }
  auto field = std::make_shared<Field>(std::move(tree), grids, std::move(kinds), std::move(light), std::move(scatter),
                                       std::move(returns));
  auto network = std::make_shared<const VertexNetwork>(light_parts, NeuralShape{});
  auto parameters = network->initial(3);
  for (std::size_t i = network->first_of_head(0); i < parameters.size(); ++i)
    parameters[i] = 0.2f * (2 * sample_float(17, static_cast<std::uint32_t>(i)) - 1);
  return Neural(std::move(field), std::move(network), {{0.1f, 0, 0}, 0.9f}, std::move(parameters), numbers);
}

struct Drawn {
  std::array<std::vector<float>, 3> y;
  std::vector<float> inv_q, inv_q_again;
};
Drawn draw(const Neural& neural, VertexNumbers which, std::size_t from = 0) {
  const VertexContextBuffer buffer = vertices();
  const VertexContext context = buffer.view().from(from);
  const std::size_t n = kVertices - from;
  std::array<std::vector<double>, 3> z;
  Drawn drawn;
  for (std::uint32_t a = 0; a < 3; ++a) {
    drawn.y[a].resize(n);
    for (std::size_t i = 0; i < n; ++i) z[a].push_back(sample_double(sample_key(19, from + i), a));
  }
  drawn.inv_q.resize(n);
  drawn.inv_q_again.resize(n);
  std::vector<std::uint32_t> places(n * neural.place_size());
  neural.locate(context, n, places.data());
  const std::array<float*, 3> y{drawn.y[0].data(), drawn.y[1].data(), drawn.y[2].data()};
  neural.sample(which, context, places.data(), n, {z[0].data(), z[1].data(), z[2].data()}, y, drawn.inv_q.data());
  neural.inverse_density(which, context, places.data(), n, {y[0], y[1], y[2]}, drawn.inv_q_again.data());
  return drawn;
}

TEST(Neural, SamplesAndDensitiesAgree) {
  for (const int parts : {1, 3, 93, 1000}) {
    const Neural neural = example(parts);
    for (const auto which : {VertexNumbers::light, VertexNumbers::scatter}) {
      const Drawn drawn = draw(neural, which);
      double spread = 0;
      for (std::size_t i = 0; i < kVertices; ++i) {
        EXPECT_NEAR(static_cast<double>(drawn.inv_q[i]) / static_cast<double>(drawn.inv_q_again[i]), 1, 1e-4);
        spread += std::fabs(std::log(static_cast<double>(drawn.inv_q[i]))) / kVertices;
      }
      EXPECT_GT(spread, 0.1) << "not uniform";
    }
  }
}

// What is drawn at a vertex must not depend on which others are in its batch.
TEST(Neural, VerticesDoNotKnowOfEachOther) {
  const Neural neural = example(3);
  for (const auto which : {VertexNumbers::light, VertexNumbers::scatter}) {
    const Drawn all = draw(neural, which), rest = draw(neural, which, 77);
    for (std::size_t i = 77; i < kVertices; ++i) {
      ASSERT_EQ(all.inv_q[i], rest.inv_q[i - 77]);
      for (std::size_t a = 0; a < 3; ++a) ASSERT_EQ(all.y[a][i], rest.y[a][i - 77]);
    }
  }
}

TEST(Neural, IsTheSameAfterSavingAndLoading) {
  const Layout numbers = Layout::parse("bounce1.lobe+bounce1+bounce2.light+bounce2.light_uv");
  const Neural neural = example(5, numbers);
  TensorFile file;
  neural.save(file, "warp.");
  const auto loaded = Neural::load(file, "warp.");
  for (const auto which : {VertexNumbers::light, VertexNumbers::scatter}) {
    const Drawn a = draw(neural, which), b = draw(*loaded, which);
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
