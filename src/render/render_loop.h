#pragma once
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/ordered.h"
#include "core/pass_record.h"
#include "estimate/image_estimator.h"
#include "render/automatic.h"
#include "train/vertex_trainer.h"

namespace warpath {

/// How much to render: samples per pixel, or until a deadline, or what was rendered until an earlier one.
struct Budget {
  int spp = 0;
  std::optional<std::chrono::steady_clock::time_point> deadline;
  std::vector<PassRecord> replay;  ///< if there are any: these passes, whatever the time
  /// Whether the clock decides, or has decided: such a render can only be repeated by the record of its passes.
  bool by_clock() const { return deadline || !replay.empty(); }
};

/// What passes hand on to those that follow.
struct Guide {
  std::optional<Objective> objective{};      ///< where samples go; else every pixel has as many
  std::shared_ptr<const VertexWarp> warp{};  ///< draws the numbers of vertices; null: they are uniform
  std::unique_ptr<VertexTrainer> trainer{};  ///< learns the warp from each pass for the next; null: it stays
  std::vector<Contender> contenders{};       ///< of `auto`, which chooses among them; then there is no warp or trainer
  std::string choice{};                      ///< what it chose, and why
  bool keep = false;                         ///< learns from the last pass, too: the warp is wanted, not the image
  double fit_seconds = 0;                    ///< spent between passes
  double fit_cpu_seconds = 0;                ///< the same, of all threads
  std::uint64_t taught = 0;                  ///< paths that the warp has learned from
  bool empty() const { return !objective && !warp && !trainer && contenders.empty(); }
};

/// Renders in passes that double what is there, so that an image that ends early is even, and calls `checkpoint` after
/// each. Every pass uses what the guide has learned from those before, and counts in the image. Ends early on Ctrl-C.
/// Returns what was decided for each pass.
std::vector<PassRecord> render_passes(ImageEstimator& estimator, const Budget& budget, Guide& guide,
                                      const Progress& progress, const std::function<void()>& checkpoint);

}  // namespace warpath
