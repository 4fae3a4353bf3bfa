#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "core/ordered.h"
#include "estimate/image_estimator.h"
#include "render/pass_policy.h"
#include "train/vertex_learner.h"

namespace warpath {

/// A warp of vertices on its way through a render.
struct OnlineWarp {
  std::shared_ptr<const VertexProposal> proposal{};  ///< draws the numbers of vertices; null: nothing was learned yet
  std::unique_ptr<VertexLearner> learner{};  ///< learns from each pass for the next; null: the warp stays as it is
  double fit_seconds = 0;                    ///< spent between passes
  double fit_cpu_seconds = 0;                ///< the same, of all threads
  std::uint64_t taught = 0;                  ///< paths that the warp has learned from
};

/// How the samples of a render are placed and drawn, whatever its passes are.
struct PassSettings {
  /// Whether the film is stratified and passes are told what earlier ones found; else they are all alike.
  bool guided = false;
  std::optional<Objective> objective{};  ///< where samples go; else every pixel has as many
};

/// Renders the passes that a policy plans, and calls `checkpoint` after each. Every pass uses what the warp has learned
/// from those before, and counts in the image. Ends early on Ctrl-C. Returns what was decided for each pass.
std::vector<PassRecord> render_passes(ImageEstimator& estimator, PassPolicy& policy, const PassSettings& settings,
                                      OnlineWarp& warp, const Progress& progress,
                                      const std::function<void()>& checkpoint);

}  // namespace warpath
