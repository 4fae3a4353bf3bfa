#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "path/primary_source.h"

namespace warpath {

/// Where vertices lie: what networks take for the unit cube.
struct VertexBox {
  std::array<float, 3> low{0, 0, 0};
  float scale = 1;  ///< 1 / longest side
};

/// A box around all but the outermost hundredth along each axis: a ground that reaches to the horizon would leave no
/// detail to the rest. The same number of coordinates for each axis, at least one.
VertexBox box_around(std::array<std::vector<float>, 3> coordinates);

/// What networks see of a vertex, in rows of nn::kBlock numbers: the position in a one-blob encoding [MMRGN19] of
/// `position_bins` along each axis, the normal, the direction of the previous vertex and its reflection, albedo,
/// roughness, kind of surface and material.
int encoded_vertex_rows(int position_bins);

/// Encodes some vertices of a context, at most nn::kBlock; x: encoded_vertex_rows(position_bins) x kBlock, aligned to
/// nn::kAlignment.
void encode_vertices(const VertexBox& box, int position_bins, const VertexContext& context,
                     std::span<const std::uint32_t> vertices, float* x);

}  // namespace warpath
