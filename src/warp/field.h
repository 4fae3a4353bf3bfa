#pragma once
#include <memory>
#include <vector>

#include "warp/field_tree.h"
#include "warp/halving_density.h"
#include "warp/vertex_decision.h"

namespace warpath {

/// How a field cuts the numbers of a vertex.
struct FieldGrids {
  /// light_parts: number of equally likely emitters; 1 if there is no choice among them.
  explicit FieldGrids(int light_parts);
  const HalvingGrid& grid(VertexDecision which, SurfaceKind kind) const {
    return which == VertexDecision::light_sampling ? light
           : kind == SurfaceKind::diffuse          ? diffuse
           : kind == SurfaceKind::delta            ? delta
                                                   : mixed;
  }
  int light_parts;
  HalvingGrid light, diffuse, mixed, delta;
};

/// A field of densities in world space: a FieldTree whose cells each hold a piecewise-constant density over the numbers
/// of light sampling, and one over those of scattering. A vertex in no cell draws uniform numbers. Of one vertex alone
/// it is a warp conditioned on what the path knows there: of the first, on what the film shows.
class Field final : public VertexProposal {
 public:
  /// What comes back to a vertex of a cell, by light sampling or through the direction that is scattered into.
  struct Return {
    float mean = 0;     ///< luminance over the throughput at the vertex
    float learned = 0;  ///< share of the learned density in that of the numbers; the rest is uniform
  };
  struct Returns {
    Return light, scatter;
  };
  /// light, scatter: a density for each cell, see HalvingGrid; all scatter grids store as many numbers. numbers: those
  /// that it draws, see check_decisions; empty for those of every vertex.
  Field(FieldTree tree, FieldGrids grids, std::vector<SurfaceKind> kinds, std::vector<CumulativeProbability> light,
        std::vector<CumulativeProbability> scatter, std::vector<Returns> returns, Layout numbers = {});

  std::string family() const override { return "field"; }
  bool warps(VertexDecision which, std::uint16_t bounce) const override {
    return holds_decision(m_numbers, which, bounce);
  }
  const Layout& numbers() const override { return m_numbers; }
  /// A place is a cell.
  void locate(const VertexContext& context, std::size_t n, std::uint32_t* places) const override;
  void sample(VertexDecision which, const VertexContext& context, const std::uint32_t* places, std::size_t n,
              const std::array<const double*, 3>& z, const std::array<float*, 3>& y, float* inv_q) const override;
  void inverse_density(VertexDecision which, const VertexContext& context, const std::uint32_t* places, std::size_t n,
                       const std::array<const float*, 3>& y, float* inv_q) const override;
  bool expect_return(const std::uint32_t* places, std::size_t n, const float* inv_q, float* expected) const override;
  void save(TensorFile& file, const std::string& prefix) const override;
  /// Throws FileError.
  static std::shared_ptr<const Field> load(const TensorFile& file, const std::string& prefix);

  const FieldTree& tree() const { return m_tree; }
  const FieldGrids& grids() const { return m_grids; }

  SurfaceKind kind(std::uint32_t cell) const { return m_kinds[cell]; }
  const Return& returns(VertexDecision which, std::uint32_t cell) const {
    return which == VertexDecision::light_sampling ? m_returns[cell].light : m_returns[cell].scatter;
  }
  /// The density of a cell; null for FieldTree::kNoCell.
  const CumulativeProbability* density(VertexDecision which, std::uint32_t cell) const;

 private:
  FieldTree m_tree;
  FieldGrids m_grids;
  std::vector<SurfaceKind> m_kinds;  // of each cell
  std::vector<CumulativeProbability> m_light, m_scatter;
  std::vector<Returns> m_returns;
  Layout m_numbers;
};

}  // namespace warpath
