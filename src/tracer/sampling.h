#pragma once
#include <cmath>

#include "core/math.h"

namespace warpath {

// Maps from the unit square, the same as Mitsuba 3's, and affine maps.

/// The whole sphere; u.x is the azimuth, u.y runs from +z to -z; density 1 / (4 pi).
inline Vec3 sample_sphere(const Vec2& u) {
  const float z = 1 - 2 * u.y;
  const float r = std::sqrt(larger(0.0f, 1 - z * z));
  const float phi = 2 * kPi * u.x;
  return {r * std::cos(phi), r * std::sin(phi), z};
}

/// Barycentric coordinates (b1, b2) of a triangle; density 1 / area.
inline Vec2 sample_triangle(const Vec2& u) {
  const float t = std::sqrt(larger(0.0f, 1 - u.x));
  return {1 - t, t * u.y};
}

/// Affine maps in Imath's row-vector convention.
inline Vec3 transform_point(const Matrix4& m, const Vec3& p) {
  return {p.x * m[0][0] + p.y * m[1][0] + p.z * m[2][0] + m[3][0],
          p.x * m[0][1] + p.y * m[1][1] + p.z * m[2][1] + m[3][1],
          p.x * m[0][2] + p.y * m[1][2] + p.z * m[2][2] + m[3][2]};
}
inline Vec3 transform_vector(const Matrix4& m, const Vec3& v) {
  return {v.x * m[0][0] + v.y * m[1][0] + v.z * m[2][0], v.x * m[0][1] + v.y * m[1][1] + v.z * m[2][1],
          v.x * m[0][2] + v.y * m[1][2] + v.z * m[2][2]};
}
/// The normal of a transformed surface: times the inverse transpose of m, of which this takes the inverse. Not unit.
inline Vec3 transform_normal(const Matrix4& inverse, const Vec3& n) {
  return {n.x * inverse[0][0] + n.y * inverse[0][1] + n.z * inverse[0][2],
          n.x * inverse[1][0] + n.y * inverse[1][1] + n.z * inverse[1][2],
          n.x * inverse[2][0] + n.y * inverse[2][1] + n.z * inverse[2][2]};
}
inline Vec3 lerp(const Vec3& a, const Vec3& b, float t) { return a + (b - a) * t; }
inline Matrix4 lerp(const Matrix4& a, const Matrix4& b, float t) { return a + (b - a) * t; }

}  // namespace warpath
