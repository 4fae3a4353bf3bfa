#pragma once
#include <cmath>

#include "core/math.h"

namespace warpath {

/// sin and cos of |x| <= pi / 4, within 1 ULP. [Cephes, sinf.c and cosf.c: their minimax polynomials]
inline void sincos_octant(float x, float& sin_x, float& cos_x) {
  const float z = x * x;
  sin_x = ((-1.9515295891e-4f * z + 8.3321608736e-3f) * z - 1.6666654611e-1f) * z * x + x;
  cos_x = ((2.443315711809948e-5f * z - 1.388731625493765e-3f) * z + 4.166664568298827e-2f) * z * z - 0.5f * z + 1;
}

/// The concentric map from the unit square to the unit disk: continuous, and of little distortion. [Shirley and Chiu
/// 1997, A Low Distortion Map Between Disk and Square; in Cline's form, as Mitsuba 3 has it]
inline Vec2 square_to_disk(const Vec2& u) {
  const float x = 2 * u.x - 1, y = 2 * u.y - 1;
  const bool steep = std::fabs(x) < std::fabs(y);
  const float r = steep ? y : x, other = steep ? x : y;
  if (r == 0) return {0, 0};
  float sin_phi, cos_phi;
  sincos_octant(0.25f * kPi * (other / r), sin_phi, cos_phi);
  return steep ? Vec2{r * sin_phi, r * cos_phi} : Vec2{r * cos_phi, r * sin_phi};
}

/// Directions with density cos(theta) / pi around +z.
inline Vec3 square_to_cosine_hemisphere(const Vec2& u) {
  const Vec2 p = square_to_disk(u);
  return {p.x, p.y, std::sqrt(larger(0.0f, 1 - p.x * p.x - p.y * p.y))};
}
inline float cosine_hemisphere_pdf(float cos_theta) { return cos_theta * (1 / kPi); }

}  // namespace warpath
