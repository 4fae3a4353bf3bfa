#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "nn/simd.h"
#include "warp/halving_density.h"

namespace warpath {

/// Features of a vertex: what the weights of nodes are multiplied with.
inline constexpr int kNodeFeatures = 32;

/// The tree of a HalvingGrid whose densities depend on features h. Without them a node's children have their shares of
/// its volume, or the probabilities that a field tells for a vertex: its prior. With them child c has
///   p_c = prior_c exp(b_c + W_c h) / sum of these,
/// and a bin has the mass (1 - kPriorShare) times the product of p on its way + kPriorShare times that of the priors:
/// whatever the features, q is not less than kPriorShare times the prior's. All weights 0 give the prior itself.
///
/// Weights: for each node 16 biases, then kNodeFeatures rows of 16 weights.
class NodeTree {
 public:
  static constexpr std::uint32_t kChildren = HalvingGrid::kChildren;
  static constexpr std::size_t kNodeSize = kChildren * (1 + kNodeFeatures);
  static constexpr float kPriorShare = 0.4f;

  explicit NodeTree(const HalvingGrid& grid);

  const HalvingGrid& grid() const { return m_grid; }
  std::uint32_t nodes() const { return m_nodes; }
  std::size_t parameter_count() const { return m_nodes * kNodeSize; }
  float bin_volume() const { return m_bin_volume; }
  /// For each node, the shares of its volume that its children have; and those of all children up to and with each.
  const float* shares() const { return m_shares.data(); }
  const float* reached() const { return m_reached.data(); }

 private:
  HalvingGrid m_grid;
  std::uint32_t m_nodes;
  float m_bin_volume = 0;
  nn::AlignedVector<float> m_shares, m_reached;
};

/// A draw from a tree.
struct NodeDraw {
  const NodeTree* tree;
  const float* weights;
  const CumulativeProbability* prior;  ///< the density of a field's cell, or null for that of the volume
  const float* h;                      ///< kNodeFeatures
  std::array<double, 3> z;             ///< latents
  std::array<float, 3> y;              ///< the numbers that were drawn
  float inv_q;                         ///< 1 / q(y)
};
inline constexpr std::size_t kMostDraws = 16;
/// Draws at most kMostDraws, from trees of one depth.
void sample_nodes(std::span<NodeDraw> draws);
/// 1 / q in a bin.
float inverse_node_density(const NodeTree& tree, const float* weights, const CumulativeProbability* prior,
                           const float* h, std::uint32_t bin);

/// For each node 16 rows of kNodeFeatures weights: what training needs to carry gradients from children to features.
void transpose_nodes(const NodeTree& tree, const float* weights, float* transposed);
/// Adds the gradients of the loss -weight * ln q(bin) to those of the weights (laid out as they are) and of h. Returns
/// ln q.
float train_nodes(const NodeTree& tree, const float* weights, const float* transposed,
                  const CumulativeProbability* prior, const float* h, std::uint32_t bin, float weight, float* d_weights,
                  float* d_h);

}  // namespace warpath
