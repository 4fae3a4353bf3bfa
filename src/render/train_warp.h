#pragma once
#include <cstdint>

#include "family/warp_file.h"
#include "render/renderer.h"

namespace warpath {

/// A warp that was trained to be saved.
struct TrainedWarp {
  WarpFile file;
  std::uint64_t paths = 0;  ///< that it learned from: candidates, or samples of passes
  double seconds = 0;
};

/// Trains what a method names: on candidates, or on passes of as many paths. Throws ConfigError where there is nothing
/// to train, and Interrupted.
TrainedWarp train_warp(Renderer& renderer, const Method& method, const TrainSettings& training);
/// Throws ConfigError where there is nothing to train.
void check_trainable(const Method& method);

}  // namespace warpath
