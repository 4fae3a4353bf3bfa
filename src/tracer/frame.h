#pragma once
#include "core/math.h"

namespace warpath {

/// Three unit vectors at right angles. Local z is the normal. Left-handed where a BSDF is seen from behind.
struct Frame {
  Vec3 s, t, n;
  Vec3 to_local(const Vec3& v) const { return {v.dot(s), v.dot(t), v.dot(n)}; }
  Vec3 to_world(const Vec3& v) const { return s * v.x + t * v.y + n * v.z; }
};

/// A right-handed frame that depends on the unit normal alone and changes smoothly with it, so that neighbouring points
/// of a surface mean the same by the same primary numbers. It is the reflection that takes a fixed pole to -n, and
/// breaks only within 0.6 degrees of the direction opposite to that pole. The pole is an odd direction: methods that
/// break on the equator or at an axis [Duff et al. 2017, Building an Orthonormal Basis, Revisited] tear the floors and
/// walls of real scenes, whose normals are axes plus rounding noise.
inline Frame frame_of_normal(const Vec3& n) {
  const Vec3 pole{0.36f, 0.48f, 0.8f}, e1{0.8f, -0.6f, 0.0f}, e2{0.48f, 0.64f, -0.6f};
  Vec3 h = n + pole;
  float hh = h.dot(h);
  float side = 1;
  if (hh < 1e-4f) {
    h = n - pole;
    hh = h.dot(h);
    side = -1;
  }
  const float k = 2 / hh;
  return {e1 - h * (k * h.dot(e1)), (e2 - h * (k * h.dot(e2))) * side, n};
}

/// The frame whose s follows `tangent` as far as the unit normal n allows; t = n x s, or its opposite if left_handed.
/// Where the tangent gives no direction, frame_of_normal.
inline Frame frame_of_tangent(const Vec3& n, const Vec3& tangent, bool left_handed) {
  const Vec3 s = tangent - n * n.dot(tangent);
  const float ss = s.dot(s);
  // A tangent along n leaves only rounding errors of its own length.
  if (!(ss > 1e-10f * tangent.dot(tangent)) || !std::isfinite(ss)) return frame_of_normal(n);
  const Vec3 unit_s = s * (1 / std::sqrt(ss));
  const Vec3 t = n.cross(unit_s);
  return {unit_s, left_handed ? -t : t, n};
}

}  // namespace warpath
