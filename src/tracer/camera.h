#pragma once
#include <Imath/ImathQuat.h>

#include "scene/scene.h"
#include "tracer/ray_stream.h"

namespace warpath {

/// The perspective camera, pinhole or thin lens. Looks along +z of its own space, +x to the left of the picture, +y up,
/// as Mitsuba's do. Between its two keyframes it turns along the shortest arc and its position moves on a straight
/// line.
class Camera {
 public:
  Camera(const Sensor& sensor, const FilmSettings& film);

  struct Ray {
    Vec3 origin, direction;
    float t_max;
  };
  /// film in [0,1)^2 over the whole film, y down; lens in [0,1)^2; time in [0,1] within the shutter. The ray starts at
  /// the near clipping plane and ends at the far one.
  Ray ray(const Vec2& film, const Vec2& lens, float time) const;
  /// The same for n film positions x, y, of a pinhole that stands still: for loops without branches. Leaves the rays'
  /// times alone.
  void pinhole_rays(std::size_t n, const float* x, const float* y, const RayStream& rays) const;

  bool has_lens() const { return m_aperture_radius > 0; }
  bool moves() const { return m_moves; }
  /// World to film, for a pinhole that stands still: (x, y) z and z, where (x, y) is in [0,1]^2 for what is seen.
  Vec3 project(const Vec3& world) const;
  Vec3 position() const { return m_translation[0]; }

 private:
  Vec3 to_world(const Vec3& direction, float time) const;

  float m_tan_x, m_tan_y;  // of half the field of view
  float m_principal_x, m_principal_y;
  float m_near, m_far, m_aperture_radius, m_focus_distance;
  bool m_moves;
  Matrix4 m_rotation, m_world_to_camera;  // of the first keyframe
  Vec3 m_translation[2];
  Imath::Quatf m_turn[2];  // a rigid transform is an optional reflection of x, then a turn
  float m_mirror = 1;
};

}  // namespace warpath
