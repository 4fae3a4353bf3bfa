#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "train/cell_density.h"
#include "train/cell_draws.h"
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
  void merge(VertexRecorder& recorder) override;
  /// The field after all passes so far; cells that have seen many vertices are cut for the passes to come.
  std::shared_ptr<const Field> fit_field();
  std::shared_ptr<const VertexProposal> fit() override { return fit_field(); }

 private:
  class Recorder;

  /// Sums over vertices.
  struct Cell {
    SurfaceKind kind;
    double visits = 0;
    CellDraws light, scatter;
    std::array<double, FieldTree::kFeatures> sum{}, square{};  // of features
  };

  void add_root(std::uint32_t key);
  void cut_cells();
  /// extent2: squared width of the scene. Returns false if all vertices of the cell are in one place.
  bool cut(std::uint32_t cell, double extent2);

  FieldSettings m_settings;
  FieldGrids m_grids;
  FieldTree m_tree;
  // As it was before this pass: recorders look vertices up while batches are merged, which may add roots.
  std::shared_ptr<const FieldTree> m_tree_of_pass = std::make_shared<const FieldTree>();
  std::vector<Cell> m_cells;
  std::vector<CellBin> m_light, m_scatter;  // bins() for each cell
};

}  // namespace warpath
