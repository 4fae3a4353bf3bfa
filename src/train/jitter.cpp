#include "train/jitter.h"

#include <cmath>
#include <numbers>

#include "core/rng.h"

namespace warpath {
namespace {

/// Back into [0,1], as if its borders were mirrors.
double reflected(double y) { return std::abs(std::remainder(y, 2.0)); }

}  // namespace

void jitter(std::span<float> y, double width, std::uint64_t seed, std::uint64_t k) {
  const std::uint64_t key = sample_key(seed, k);
  // Two dimensions share one pair of uniform numbers (Box and Muller's transform).
  for (std::size_t d = 0; d < y.size(); d += 2) {
    const double radius = width * std::sqrt(-2 * std::log1p(-sample_double(key, static_cast<std::uint32_t>(d))));
    const double angle = 2 * std::numbers::pi * sample_double(key, static_cast<std::uint32_t>(d + 1));
    y[d] = to_primary(reflected(static_cast<double>(y[d]) + radius * std::cos(angle)));
    if (d + 1 < y.size()) y[d + 1] = to_primary(reflected(static_cast<double>(y[d + 1]) + radius * std::sin(angle)));
  }
}

}  // namespace warpath
