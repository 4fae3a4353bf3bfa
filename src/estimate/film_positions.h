#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/math.h"

namespace warpath {

/// A film number in [0,1) from a pixel (column or row), an offset in [0,1) inside it, and the size of the film in
/// pixels. Rounding never carries it into the next pixel.
inline float film_position(std::uint32_t pixel, float offset, int size) {
  const float lowest = static_cast<float>(pixel), next = std::nextafter(lowest + 1, 0.0f);
  return std::min(std::min(lowest + offset, next) / static_cast<float>(size), kOneMinusEpsilon);
}

}  // namespace warpath
