#pragma once
#include <cstddef>
#include <numeric>

namespace warpath {

/// A stride that comes to all of n things, modulo n, each far from the one before: their number over the golden ratio,
/// or the next that has no divisor in common with it.
inline std::size_t scattering_stride(std::size_t n) {
  auto stride = static_cast<std::size_t>(0.6180339887498949 * static_cast<double>(n));
  while (std::gcd(stride, n) != 1) ++stride;
  return stride;
}

}  // namespace warpath
