#include "tracer/camera.h"

#include <Imath/ImathMatrixAlgo.h>

#include "tracer/sample_square_to_hemisphere.h"
#include "tracer/sampling.h"
#include "warpath/error.h"

namespace warpath {

Camera::Camera(const Sensor& sensor, const FilmSettings& film)
    : m_tan_x(std::tan(0.5f * sensor.x_fov * kPi / 180)),
      m_tan_y(m_tan_x * static_cast<float>(film.height) / static_cast<float>(film.width)),
      m_principal_x(sensor.principal_x),
      m_principal_y(sensor.principal_y),
      m_near(sensor.near_clip),
      m_far(sensor.far_clip),
      m_aperture_radius(sensor.aperture_radius),
      m_focus_distance(sensor.focus_distance),
      m_moves(sensor.to_world[0] != sensor.to_world[1]),
      m_rotation(sensor.to_world[0]),
      m_world_to_camera(sensor.to_world[0].inverse()) {
  m_mirror = m_rotation.determinant() < 0 ? -1.0f : 1.0f;
  for (int k = 0; k < 2; ++k) {
    Matrix4 m = sensor.to_world[k];
    m_translation[k] = m.translation();
    for (int j = 0; j < 3; ++j) m[0][j] *= m_mirror;
    m_turn[k] = Imath::extractQuat(m).normalized();
  }
}

Vec3 Camera::to_world(const Vec3& direction, float time) const {
  if (!m_moves) return transform_vector(m_rotation, direction);
  const Imath::Quatf turn = Imath::slerpShortestArc(m_turn[0], m_turn[1], time);
  return turn.rotateVector({m_mirror * direction.x, direction.y, direction.z});
}

Camera::Ray Camera::ray(const Vec2& film, const Vec2& lens, float time) const {
  const Vec3 pinhole((1 - 2 * (film.x + m_principal_x)) * m_tan_x, (1 - 2 * (film.y + m_principal_y)) * m_tan_y, 1);
  Vec3 on_lens(0), d = pinhole;
  if (has_lens()) {
    const Vec2 at = square_to_disk(lens) * m_aperture_radius;
    on_lens = {at.x, at.y, 0};
    d = pinhole * m_focus_distance - on_lens;
  }
  d = unit(d);
  const Vec3 translation = m_moves ? lerp(m_translation[0], m_translation[1], time) : m_translation[0];
  Ray ray;
  ray.direction = unit(to_world(d, time));
  ray.origin = translation + to_world(on_lens, time) + ray.direction * (m_near / d.z);
  ray.t_max = (m_far - m_near) / d.z;
  return ray;
}

void Camera::pinhole_rays(std::size_t n, const float* __restrict x, const float* __restrict y,
                          const RayStream& rays) const {
  WARPATH_CHECK(!has_lens() && !m_moves);
  const Matrix4 m = m_rotation;
  const Vec3 o = m_translation[0];
  const float tan_x = m_tan_x, tan_y = m_tan_y, principal_x = m_principal_x, principal_y = m_principal_y;
  const float near = m_near, depth = m_far - m_near;
  float* __restrict ox = rays.ox, * __restrict oy = rays.oy, * __restrict oz = rays.oz, * __restrict dx = rays.dx, * __restrict dy = rays.dy, * __restrict dz = rays.dz, * __restrict t_max = rays.t_max;
  for (std::size_t i = 0; i < n; ++i) {
    const float px = (1 - 2 * (x[i] + principal_x)) * tan_x, py = (1 - 2 * (y[i] + principal_y)) * tan_y;
    const float length = std::sqrt(px * px + py * py + 1), inverse = 1 / length;
    const float lx = px * inverse, ly = py * inverse;
    const float wx = lx * m[0][0] + ly * m[1][0] + inverse * m[2][0];
    const float wy = lx * m[0][1] + ly * m[1][1] + inverse * m[2][1];
    const float wz = lx * m[0][2] + ly * m[1][2] + inverse * m[2][2];
    const float scale = 1 / std::sqrt(wx * wx + wy * wy + wz * wz), start = near * length;
    dx[i] = wx * scale, dy[i] = wy * scale, dz[i] = wz * scale;
    ox[i] = o.x + dx[i] * start, oy[i] = o.y + dy[i] * start, oz[i] = o.z + dz[i] * start;
    t_max[i] = depth * length;
  }
}

Vec3 Camera::project(const Vec3& world) const {
  const Vec3 p = transform_point(m_world_to_camera, world);
  return {p.z * (0.5f - m_principal_x) - 0.5f * p.x / m_tan_x, p.z * (0.5f - m_principal_y) - 0.5f * p.y / m_tan_y,
          p.z};
}

}  // namespace warpath
