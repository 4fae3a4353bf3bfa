#pragma once
#include <cstdint>
#include <span>

namespace warpath {

/// Moves `y` in [0,1)^D by a Gaussian of standard deviation `width` in each dimension, reflected at the borders: the
/// smoothed bootstrap of [SY87]. The move is a function of (seed, k) alone.
void jitter(std::span<float> y, double width, std::uint64_t seed, std::uint64_t k);

}  // namespace warpath
