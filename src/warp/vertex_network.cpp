#include "warp/vertex_network.h"

#include <algorithm>

#include "core/rng.h"
#include "warp/spline_kernels.h"

namespace warpath {
namespace {

using nn::kBlock;

constexpr std::array kKinds{SurfaceKind::diffuse, SurfaceKind::glossy, SurfaceKind::mixed, SurfaceKind::delta,
                            SurfaceKind::null};
/// A material is told by as many signs, which are the same for every render of a scene.
constexpr int kMaterialSigns = 8;
/// Normal, wi, reflection of wi, albedo; cosine, roughness.
constexpr int kPlainInputs = 4 * 3 + 2;

int inputs(const NeuralShape& shape) {
  return 3 * (1 + shape.position_bins) + kPlainInputs + static_cast<int>(kKinds.size()) + kMaterialSigns;
}

}  // namespace

VertexNetwork::VertexNetwork(int light_parts, const NeuralShape& shape)
    : m_shape(shape),
      m_grids(light_parts),
      m_trunk(inputs(shape), shape.width, shape.blocks, kNodeFeatures, nn::Norm::none),
      m_trees{NodeTree(m_grids.light), NodeTree(m_grids.diffuse), NodeTree(m_grids.mixed), NodeTree(m_grids.delta)} {
  m_first_of_head[0] = m_trunk.parameter_count();
  for (std::size_t h = 0; h < kHeads; ++h) m_first_of_head[h + 1] = m_first_of_head[h] + m_trees[h].parameter_count();
}

nn::AlignedVector<float> VertexNetwork::initial(std::uint64_t key) const {
  nn::AlignedVector<float> parameters(parameter_count(), 0.0f);
  m_trunk.initialise(parameters.data(), key, 1);
  return parameters;
}

void VertexNetwork::encode(const VertexBox& box, const VertexContext& context, std::size_t first, std::size_t n,
                           float* x) const {
  const auto fill = [&](const auto& value) {
    for (std::size_t s = 0; s < n; ++s) x[s] = value(first + s);
    std::fill(x + n, x + kBlock, 0.0f);
    x += kBlock;
  };
  alignas(64) std::array<float, kBlock> place{};
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t s = 0; s < n; ++s)
      place[s] = std::clamp((context.position[a][first + s] - box.low[a]) * box.scale, 0.0f, 1.0f);
    spline::encode(m_shape.position_bins, place.data(), x);
    x += (1 + m_shape.position_bins) * kBlock;
  }
  alignas(64) std::array<float, kBlock> cosine{};
  for (std::size_t s = 0; s < n; ++s)
    for (std::size_t a = 0; a < 3; ++a) cosine[s] += context.normal[a][first + s] * context.wi[a][first + s];
  for (std::size_t a = 0; a < 3; ++a) {
    fill([&](std::size_t i) { return context.normal[a][i]; });
    fill([&](std::size_t i) { return context.wi[a][i]; });
    fill([&](std::size_t i) { return 2 * cosine[i - first] * context.normal[a][i] - context.wi[a][i]; });
    fill([&](std::size_t i) { return context.albedo[a][i]; });
  }
  fill([&](std::size_t i) { return cosine[i - first]; });
  fill([&](std::size_t i) { return context.roughness[i]; });
  for (const SurfaceKind kind : kKinds)
    fill([&](std::size_t i) { return static_cast<SurfaceKind>(context.kind[i]) == kind ? 1.0f : 0.0f; });
  for (int bit = 0; bit < kMaterialSigns; ++bit)
    fill([&](std::size_t i) { return (context.material[i] * 0x9e3779b1u) >> (31 - bit) & 1 ? 1.0f : -1.0f; });
}

}  // namespace warpath
