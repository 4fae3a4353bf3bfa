#pragma once
#include <cstddef>

namespace warpath {

/// Lanes of one wavefront: enough to fill SIMD kernels and to sort rays, few enough to stay in L2. A tenth of uniform
/// samples, and the rest, fill whole blocks of 64 in the kernels of a warp.
inline constexpr std::size_t kBatchLanes = 2560;

}  // namespace warpath
