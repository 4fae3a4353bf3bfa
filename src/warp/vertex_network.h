#pragma once
#include <array>
#include <cstdint>

#include "nn/residual_net.h"
#include "warp/field.h"
#include "warp/node_kernels.h"
#include "warp/vertex_encoding.h"
#include "warp/vertex_warp.h"
#include "warpath/train.h"

namespace warpath {

/// A network that corrects the densities of a field by what the path knows at a vertex.
///
/// It sees vertices as encode_vertices shows them, and makes kNodeFeatures features of them. There is one NodeTree for
/// the numbers of light sampling, and one for those of scattering at each of three kinds of surface.
class VertexNetwork {
 public:
  static constexpr std::size_t kHeads = 4;

  VertexNetwork(int light_parts, const NeuralShape& shape);

  const FieldGrids& grids() const { return m_grids; }
  const NeuralShape& shape() const { return m_shape; }
  const nn::ResidualNet& trunk() const { return m_trunk; }

  /// Which tree the numbers of a vertex come from.
  static std::size_t head_of(VertexNumbers which, SurfaceKind kind) {
    return which == VertexNumbers::light ? 0 : kind == SurfaceKind::diffuse ? 1 : kind == SurfaceKind::delta ? 3 : 2;
  }
  const NodeTree& tree(std::size_t head) const { return m_trees[head]; }

  // Parameters: those of the trunk, then those of the trees in turn.
  std::size_t first_of_head(std::size_t head) const { return m_first_of_head[head]; }
  std::size_t parameter_count() const { return m_first_of_head[kHeads]; }
  /// Nothing is corrected yet.
  nn::AlignedVector<float> initial(std::uint64_t key) const;

 private:
  NeuralShape m_shape;
  FieldGrids m_grids;
  nn::ResidualNet m_trunk;
  std::array<NodeTree, kHeads> m_trees;
  std::array<std::size_t, kHeads + 1> m_first_of_head;
};

}  // namespace warpath
