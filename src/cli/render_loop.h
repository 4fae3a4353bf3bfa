#pragma once
#include <chrono>
#include <functional>
#include <optional>

#include "core/ordered.h"
#include "estimate/image_estimator.h"

namespace warpath {

/// How much to render: samples per pixel, or until a deadline.
struct Budget {
  int spp = 0;
  std::optional<std::chrono::steady_clock::time_point> deadline;
};

/// Renders in passes that double what is there, so that an image that ends early is even, and calls `checkpoint` after
/// each. Ends early on Ctrl-C.
void render_passes(ImageEstimator& estimator, const Budget& budget, const Progress& progress,
                   const std::function<void()>& checkpoint);

}  // namespace warpath
