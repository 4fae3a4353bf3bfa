#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "warp/film_tiling.h"
#include "warp/kdtree.h"
#include "warp/vertex_decision.h"

namespace warpath {

/// A density over the numbers of one vertex given where on the film the path began: the mean of the kd-trees of the
/// tiles that lie there, mixed with a share of uniform numbers, which keeps weights bounded. Sampling is a look-up in
/// one tree, its density a look-up in each.
class ConditionalKdTree final : public VertexProposal {
 public:
  static constexpr int kMostTilings = 8;
  /// A tree over three numbers for each tile of all tilings; no nodes where nothing was learned.
  using Trees = std::vector<KdTree::Nodes>;
  /// trees: for the numbers of light sampling and of scattering; each a tree (see KdTree::problem) or empty. uniform:
  /// in [0,1). numbers: those that it draws, see check_decisions.
  ConditionalKdTree(const FilmTiling& tiling, const std::array<Trees, 2>& trees, double uniform, Layout numbers);

  std::string family() const override { return "conditional-kdtree"; }
  bool warps(VertexDecision which, std::uint16_t bounce) const override {
    return holds_decision(m_numbers, which, bounce);
  }
  const Layout& numbers() const override { return m_numbers; }
  /// A place is a tile of each tiling.
  std::size_t place_size() const override { return static_cast<std::size_t>(m_tiling.tilings); }
  void locate(const VertexContext& context, std::size_t n, std::uint32_t* places) const override;
  void sample(VertexDecision which, const VertexContext& context, const std::uint32_t* places, std::size_t n,
              const std::array<const double*, 3>& z, const std::array<float*, 3>& y, float* inv_q) const override;
  void inverse_density(VertexDecision which, const VertexContext& context, const std::uint32_t* places, std::size_t n,
                       const std::array<const float*, 3>& y, float* inv_q) const override;
  void save(TensorFile& file, const std::string& prefix) const override;
  /// Throws FileError.
  static std::shared_ptr<const ConditionalKdTree> load(const TensorFile& file, const std::string& prefix);

 private:
  /// The children of a node stand side by side; a leaf's dim is kLeaf, and its y_split its density.
  struct Node {
    float y_split, z_split;
    std::uint32_t child_and_dim;  ///< index of the lower child << 2 | dimension
  };
  static constexpr std::uint32_t kLeaf = 3, kNoTree = 0xffffffffu;
  struct Flat {
    std::vector<Node> nodes;
    std::vector<std::uint32_t> roots;  // of each tile
  };

  static void append(const KdTree::Nodes& tree, Flat& flat);
  float density(const Flat& flat, std::uint32_t tile, const std::array<float, 3>& y) const;
  float inverse_density(const Flat& flat, const std::uint32_t* tiles, const std::array<float, 3>& y) const;
  static std::array<float, 3> descend(const Flat& flat, std::uint32_t tile, const std::array<double, 3>& z);

  FilmTiling m_tiling;
  std::array<Flat, 2> m_trees;
  double m_uniform;
  Layout m_numbers;
};

}  // namespace warpath
