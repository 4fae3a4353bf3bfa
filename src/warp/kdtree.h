#pragma once
#include <cstdint>
#include <limits>
#include <vector>

#include "warp/proposal.h"

namespace warpath {

/// A piecewise constant density over the leaves of a kd-tree, as in [GBBE18], and as a bijection: the same tree cuts
/// the cube of y at `y_split` and the cube of z at `z_split`, where each side has the probability of its y side, and
/// each leaf maps its box of z to its box of y, affinely. So no coordinate is rescaled on the way down, only compared,
/// and q is the ratio of two volumes, exact in double.
class KdTree : public Warp {
 public:
  static constexpr int kMaxDims = 32;

  /// Breadth-first; the children of the k-th inner node are the nodes 2k + 1 (below the split) and 2k + 2.
  struct Nodes {
    static constexpr std::uint8_t kLeaf = 255;
    std::vector<std::uint8_t> dim;  ///< along which a node is split, or kLeaf
    std::vector<float> y_split;     ///< strictly inside the node's box; 0 for leaves
    std::vector<float> z_split;     ///< strictly inside the node's latent box; 0 for leaves
  };
  /// Throws InternalError if `problem` finds one.
  KdTree(int dims, Nodes nodes);
  /// What is wrong with a tree; empty if nothing is.
  static std::string problem(int dims, const Nodes& nodes);

  int dims() const override { return static_cast<int>(m_dims); }
  std::size_t leaf_count() const { return (m_nodes.dim.size() + 1) / 2; }
  const Nodes& nodes() const { return m_nodes; }
  std::string family() const override { return "kdtree"; }
  void forward(Batch<const double> z, Batch<double> y, std::span<double> log_det) const override;
  void inverse(Batch<const double> y, Batch<double> z, std::span<double> log_det) const override;
  void log_density(Batch<const double> y, std::span<double> log_q) const override;
  void save(TensorFile& file, const std::string& prefix) const override;
  static std::shared_ptr<const KdTree> load(const TensorFile& file, const std::string& prefix);

 private:
  /// 8 bytes, so that a tree of 2^14 leaves stays in L2. A leaf links to itself and never takes the other side: lanes
  /// that are down early wait there without a branch.
  struct Link {
    float split;
    std::uint32_t child_and_dim;  ///< index of the lower child << 5 | dimension
  };

  template <class Leaf>
  void descend(const std::vector<Link>& tree, Batch<const double> x, Leaf&& at_leaf) const;

  std::size_t m_dims;
  Nodes m_nodes;
  std::vector<Link> m_z_tree, m_y_tree;
  /// Box of each node, 4 x D floats: z_low, z_high, y_low, y_high. In 4D that is one cache line.
  std::vector<float> m_boxes;
  std::vector<double> m_log_density;  ///< ln q in each node's box
};

}  // namespace warpath
