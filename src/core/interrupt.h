#pragma once
#include <atomic>

namespace warpath {

/// Set by Ctrl-C. Loops that take long look at it between batches and end early with what they have.
inline std::atomic<bool> g_interrupted{false};

/// Thrown by work that has nothing to show for itself when it is interrupted (a half-trained warp).
struct Interrupted {};

}  // namespace warpath
