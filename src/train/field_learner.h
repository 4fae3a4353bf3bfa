#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "train/settings.h"
#include "train/vertex_learner.h"
#include "warp/field.h"

namespace warpath {

/// Learns a field from the vertices of passes. The density of a bin goes with the mean of what comes back: the root of
/// its second moment would make the variance of the whole remaining path least [Vorba et al. 2019, Path Guiding in
/// Production, chapter 10; Rath et al. 2020, Variance-Aware Path Guiding], but is known too badly.
class FieldLearner final : public VertexLearner {
 public:
  /// light_parts: number of equally likely emitters; 1 if there is no choice among them.
  FieldLearner(const FieldSettings& settings, int light_parts);

  /// Goes on from a field of the same scene, seen from wherever, as if each of its cells had just seen as many vertices
  /// as it takes to cut it. Before the first vertex. Throws ConfigError if it cannot be of this scene.
  void start_from(const Field& field);
  std::unique_ptr<VertexRecorder> make_recorder() const override;
  /// For passes that are drawn with another density than the field, which is what fit() gave last.
  std::unique_ptr<VertexRecorder> make_recorder(std::shared_ptr<const Field> field) const;
  void merge(VertexRecorder& recorder) override;
  /// The field after all passes so far; cells that have seen many vertices are cut for the passes to come.
  std::shared_ptr<const Field> fit_field();
  std::shared_ptr<const VertexProposal> fit() override { return fit_field(); }
  /// Mean of what came back to the vertices of a cell of the last field.
  double mean(VertexDecision which, std::uint32_t cell) const {
    return (which == VertexDecision::light_sampling ? m_cells[cell].light : m_cells[cell].scatter).mean();
  }

 private:
  class Recorder;

  /// Shares of uniform numbers that a cell chooses from.
  static constexpr std::array<float, 6> kUniform{0.05f, 0.15f, 0.3f, 0.45f, 0.65f, 0.9f};
  using ByShare = std::array<double, kUniform.size()>;

  /// Sums over draws of one kind of numbers.
  struct Draws {
    double n = 0, sum = 0, square = 0;  // of f / q
    /// What the sum of the squares of f / q would be with each share of uniform numbers; recent draws count most.
    std::array<float, kUniform.size()> with_share{};
    float learned = 0;  ///< share of the learned density in the field of this pass; 0: there is none
    void add(float term, float inv_q, float inv_own);
    void halve();
    double mean() const { return n > 0 ? sum / n : 0; }
    /// How many equal samples would tell as much: a few that outshine all others tell little.
    double effective() const { return square > 0 ? sum * sum / square : 0; }
  };
  /// Sums over vertices.
  struct Cell {
    SurfaceKind kind;
    double visits = 0;
    Draws light, scatter;
    std::array<double, FieldTree::kFeatures> sum{}, square{};  // of features
  };
  struct Bin {
    float sum = 0;  // of f / q: over the draws of the cell and the bin's volume, the mean of f
    float draws = 0;
  };

  void add_root(std::uint32_t key);
  void cut_cells();
  /// extent2: squared width of the scene. Returns false if all vertices of the cell are in one place.
  bool cut(std::uint32_t cell, double extent2);
  /// Draws::with_share over its sum, averaged over all cells of a kind; 0 if none of them has drawn yet.
  ByShare pool(SurfaceKind kind, Draws Cell::*draws) const;
  /// The share of uniform numbers with which a cell's draws would have had the least second moment; `pooled` is what
  /// cells like it say, and decides where a cell has seen little.
  double best_uniform(const Draws& draws, const ByShare& pooled) const;
  /// uniform: share of uniform numbers, if there is enough to learn from.
  void fit_density(const HalvingGrid& grid, std::span<const Bin> bins, double uniform, Draws& all,
                   CumulativeProbability* density) const;

  FieldSettings m_settings;
  FieldGrids m_grids;
  FieldTree m_tree;
  // As it was before this pass: recorders look vertices up while batches are merged, which may add roots.
  std::shared_ptr<const FieldTree> m_tree_of_pass = std::make_shared<const FieldTree>();
  std::vector<Cell> m_cells;
  std::vector<Bin> m_light, m_scatter;  // bins() for each cell
};

}  // namespace warpath
