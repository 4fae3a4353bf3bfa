#include "warp/vertex_network.h"

#include "core/rng.h"

namespace warpath {

VertexNetwork::VertexNetwork(int light_parts, const NeuralShape& shape)
    : m_shape(shape),
      m_grids(light_parts),
      m_trunk(encoded_vertex_rows(shape.position_bins), shape.width, shape.blocks, kNodeFeatures, nn::Norm::none),
      m_trees{NodeTree(m_grids.light), NodeTree(m_grids.diffuse), NodeTree(m_grids.mixed), NodeTree(m_grids.delta)} {
  m_first_of_head[0] = m_trunk.parameter_count();
  for (std::size_t h = 0; h < kHeads; ++h) m_first_of_head[h + 1] = m_first_of_head[h] + m_trees[h].parameter_count();
}

nn::AlignedVector<float> VertexNetwork::initial(std::uint64_t key) const {
  nn::AlignedVector<float> parameters(parameter_count(), 0.0f);
  m_trunk.initialise(parameters.data(), key, 1);
  return parameters;
}

}  // namespace warpath
