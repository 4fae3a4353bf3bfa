#pragma once
#include <cmath>

namespace warpath {

/// The sRGB curve, decoded (IEC 61966-2-1).
inline float srgb_to_linear(float x) { return x <= 0.04045f ? x / 12.92f : std::pow((x + 0.055f) / 1.055f, 2.4f); }

}  // namespace warpath
