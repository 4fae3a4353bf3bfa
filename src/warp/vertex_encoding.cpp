#include "warp/vertex_encoding.h"

#include <algorithm>

#include "nn/simd.h"
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

}  // namespace

VertexBox box_around(std::array<std::vector<float>, 3> coordinates) {
  VertexBox box;
  float longest = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    std::vector<float>& values = coordinates[a];
    const auto quantile = [&](double share) {
      const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
      std::nth_element(values.begin(), at, values.end());
      return *at;
    };
    box.low[a] = quantile(0.01);
    longest = std::max(longest, quantile(0.99) - box.low[a]);
  }
  box.scale = longest > 0 ? 1 / longest : 1;
  return box;
}

int encoded_vertex_rows(int position_bins) {
  return 3 * spline::encoded_rows(position_bins) + kPlainInputs + static_cast<int>(kKinds.size()) + kMaterialSigns;
}

void encode_vertices(const VertexBox& box, int position_bins, const VertexContext& context,
                     std::span<const std::uint32_t> vertices, float* x) {
  const std::size_t n = vertices.size();
  const auto fill = [&](const auto& value) {
    for (std::size_t s = 0; s < n; ++s) x[s] = value(vertices[s]);
    std::fill(x + n, x + kBlock, 0.0f);
    x += kBlock;
  };
  alignas(64) std::array<float, kBlock> place{};
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t s = 0; s < n; ++s)
      place[s] = std::clamp((context.position[a][vertices[s]] - box.low[a]) * box.scale, 0.0f, 1.0f);
    spline::encode(position_bins, place.data(), x);
    x += spline::encoded_rows(position_bins) * kBlock;
  }
  const auto cosine = [&](std::size_t i) {
    float sum = 0;
    for (std::size_t a = 0; a < 3; ++a) sum += context.normal[a][i] * context.wi[a][i];
    return sum;
  };
  for (std::size_t a = 0; a < 3; ++a) {
    fill([&](std::size_t i) { return context.normal[a][i]; });
    fill([&](std::size_t i) { return context.wi[a][i]; });
    fill([&](std::size_t i) { return 2 * cosine(i) * context.normal[a][i] - context.wi[a][i]; });
    fill([&](std::size_t i) { return context.albedo[a][i]; });
  }
  fill(cosine);
  fill([&](std::size_t i) { return context.roughness[i]; });
  for (const SurfaceKind kind : kKinds)
    fill([&](std::size_t i) { return static_cast<SurfaceKind>(context.kind[i]) == kind ? 1.0f : 0.0f; });
  for (int bit = 0; bit < kMaterialSigns; ++bit)
    fill([&](std::size_t i) { return (context.material[i] * 0x9e3779b1u) >> (31 - bit) & 1 ? 1.0f : -1.0f; });
}

}  // namespace warpath
