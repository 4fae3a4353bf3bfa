#pragma once
#include "core/math.h"
#include "scene/shape.h"

namespace warpath {

/// A sphere, disk or cylinder that may move: its keyframes are interpolated linearly over the shutter.
class AnalyticShape {
 public:
  explicit AnalyticShape(const Sphere& sphere);
  explicit AnalyticShape(const Disk& disk);
  explicit AnalyticShape(const Cylinder& cylinder);

  struct Bounds {
    Vec3 lower, upper;
  };
  Bounds bounds(float time) const;
  bool moves() const { return m_moves; }
  /// The nearest distance in (t_min, t_max) along a ray, whose direction need not be unit; false if there is none.
  bool intersect(const Vec3& origin, const Vec3& direction, float time, float t_min, float t_max, float& t) const;

  /// What lies under a point: everything about the surface but the position.
  struct Surface {
    Vec3 position;  ///< the point, brought onto the surface
    Vec3 normal;    ///< unit; flip_normals applied
    Vec2 uv;
    Vec3 dp_du, dp_dv, dn_du, dn_dv;
  };
  Surface at(const Vec3& point, float time) const;

  enum class Kind : std::uint8_t { sphere, disk, cylinder };
  Kind kind() const { return m_kind; }
  bool flip_normals() const { return m_flip; }
  Matrix4 to_world(float time) const;
  Vec3 center(float time) const { return lerp3(m_center[0], m_center[1], time); }              ///< sphere only
  float radius(float time) const { return m_radius[0] + (m_radius[1] - m_radius[0]) * time; }  ///< sphere only

 private:
  static Vec3 lerp3(const Vec3& a, const Vec3& b, float t) { return a + (b - a) * t; }
  Matrix4 to_object(float time) const;

  Kind m_kind;
  bool m_flip = false, m_moves = false;
  Vec3 m_center[2]{};
  float m_radius[2]{};
  Matrix4 m_to_world[2];
  Matrix4 m_to_object;  // of the first keyframe
};

}  // namespace warpath
