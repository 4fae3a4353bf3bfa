#include "tracer/analytic_shape.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tracer/sampling.h"

namespace warpath {
namespace {

using Vec3d = Imath::V3d;

// Real roots of a x^2 + b x + c, near <= far, without cancellation.
bool solve_quadratic(double a, double b, double c, double& near, double& far) {
  if (a == 0) {
    if (b == 0) return false;
    near = far = -c / b;
    return true;
  }
  const double discriminant = b * b - 4 * a * c;
  if (!(discriminant >= 0)) return false;
  const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  near = q / a;
  far = q != 0 ? c / q : near;
  if (near > far) std::swap(near, far);
  return true;
}

// Azimuth around z as a share of the circle, in [0,1).
float azimuth(float x, float y) {
  const float phi = std::atan2(y, x) / (2 * kPi);
  return phi < 0 ? phi + 1 : phi;
}

}  // namespace

AnalyticShape::AnalyticShape(const Sphere& sphere)
    : m_kind(Kind::sphere),
      m_flip(sphere.flip_normals),
      m_moves(sphere.center[0] != sphere.center[1] || sphere.radius[0] != sphere.radius[1]),
      m_center{sphere.center[0], sphere.center[1]},
      m_radius{sphere.radius[0], sphere.radius[1]},
      m_to_world{sphere.to_world, sphere.to_world},
      m_to_object(sphere.to_world.inverse()) {}

AnalyticShape::AnalyticShape(const Disk& disk)
    : m_kind(Kind::disk),
      m_flip(disk.flip_normals),
      m_moves(disk.to_world[0] != disk.to_world[1]),
      m_to_world{disk.to_world[0], disk.to_world[1]},
      m_to_object(disk.to_world[0].inverse()) {}

AnalyticShape::AnalyticShape(const Cylinder& cylinder)
    : m_kind(Kind::cylinder),
      m_flip(cylinder.flip_normals),
      m_moves(cylinder.to_world[0] != cylinder.to_world[1]),
      m_to_world{cylinder.to_world[0], cylinder.to_world[1]},
      m_to_object(cylinder.to_world[0].inverse()) {}

Matrix4 AnalyticShape::to_world(float time) const {
  return m_moves ? lerp(m_to_world[0], m_to_world[1], time) : m_to_world[0];
}
Matrix4 AnalyticShape::to_object(float time) const {
  return m_moves && m_kind != Kind::sphere ? to_world(time).inverse() : m_to_object;
}

AnalyticShape::Bounds AnalyticShape::bounds(float time) const {
  if (m_kind == Kind::sphere) {
    const Vec3 r(radius(time));
    return {center(time) - r, center(time) + r};
  }
  // A circle around the axis: each coordinate swings by the length of its row in the plane's two axes.
  const Matrix4 m = to_world(time);
  Vec3 swing;
  for (int k = 0; k < 3; ++k) swing[k] = std::hypot(m[0][k], m[1][k]);
  const Vec3 base = transform_point(m, {0, 0, 0});
  const Vec3 top = m_kind == Kind::cylinder ? transform_point(m, {0, 0, 1}) : base;
  Bounds bounds;
  for (int k = 0; k < 3; ++k) {
    bounds.lower[k] = std::min(base[k], top[k]) - swing[k];
    bounds.upper[k] = std::max(base[k], top[k]) + swing[k];
  }
  return bounds;
}

bool AnalyticShape::intersect(const Vec3& origin, const Vec3& direction, float time, float t_min, float t_max,
                              float& t) const {
  double near = 0, far = 0;
  if (m_kind == Kind::sphere) {
    // From the point of the ray that is nearest to the centre: robust for small spheres far away.
    const Vec3d d(direction), to_center = Vec3d(center(time)) - Vec3d(origin);
    const double a = d.dot(d), middle = to_center.dot(d) / a, r = radius(time);
    const Vec3d offset = d * middle - to_center;
    const double c = offset.dot(offset) - r * r;
    if (!(c <= 0)) return false;
    const double half = std::sqrt(-c / a);
    near = middle - half, far = middle + half;
  } else {
    const Matrix4 inverse = to_object(time);
    const Vec3d o(transform_point(inverse, origin)), d(transform_vector(inverse, direction));
    if (m_kind == Kind::disk) {
      const double at = -o.z / d.z, x = o.x + at * d.x, y = o.y + at * d.y;
      if (!(at > t_min && at < t_max && x * x + y * y <= 1)) return false;
      t = static_cast<float>(at);
      return true;
    }
    if (!solve_quadratic(d.x * d.x + d.y * d.y, 2 * (d.x * o.x + d.y * o.y), o.x * o.x + o.y * o.y - 1, near, far))
      return false;
    const auto outside = [&](double at) { return !(o.z + at * d.z >= 0 && o.z + at * d.z <= 1); };
    if (outside(near)) near = far;
    if (outside(far)) far = near;
    if (outside(near)) return false;
  }
  const double at = near > t_min ? near : far;
  if (!(at > t_min && at < t_max)) return false;
  t = static_cast<float>(at);
  return true;
}

AnalyticShape::Surface AnalyticShape::at(const Vec3& point, float time) const {
  Surface s;
  const float side = m_flip ? -1.0f : 1.0f;
  if (m_kind == Kind::sphere) {
    const Vec3 c = center(time);
    const float r = radius(time);
    const Vec3 outwards = (point - c).normalized();
    s.position = c + outwards * r;
    s.normal = outwards * side;
    const Vec3 local = transform_vector(m_to_object, outwards).normalized();
    s.uv = {azimuth(local.x, local.y), std::acos(std::clamp(local.z, -1.0f, 1.0f)) / kPi};
    const float rd = std::hypot(local.x, local.y);
    const Vec3 along_v = rd > 0 ? Vec3(local.z * local.x / rd, local.z * local.y / rd, -rd) : Vec3(1, 0, 0);
    s.dp_du = transform_vector(m_to_world[0], {-local.y, local.x, 0}) * (2 * kPi);
    s.dp_dv = transform_vector(m_to_world[0], along_v) * kPi;
    s.dn_du = s.dp_du * (side / r);
    s.dn_dv = s.dp_dv * (side / r);
    return s;
  }
  const Matrix4 m = to_world(time), inverse = to_object(time);
  Vec3 local = transform_point(inverse, point);
  s.dn_du = s.dn_dv = Vec3(0);
  if (m_kind == Kind::disk) {
    local.z = 0;
    s.position = transform_point(m, local);
    s.normal = transform_normal(inverse, {0, 0, side}).normalized();
    const float r = std::hypot(local.x, local.y);
    const float cos_phi = r > 0 ? local.x / r : 0.0f, sin_phi = r > 0 ? local.y / r : 0.0f;
    s.uv = {r, azimuth(local.x, local.y)};
    s.dp_du = transform_vector(m, {cos_phi, sin_phi, 0});
    s.dp_dv = transform_vector(m, {-sin_phi, cos_phi, 0}) * (2 * kPi * r);
    return s;
  }
  const float r = std::hypot(local.x, local.y);
  local.x /= r, local.y /= r;
  s.position = transform_point(m, local);
  s.dp_du = transform_vector(m, {-local.y, local.x, 0}) * (2 * kPi);
  s.dp_dv = transform_vector(m, {0, 0, 1});
  s.normal = s.dp_du.cross(s.dp_dv).normalized() * side;
  s.uv = {azimuth(local.x, local.y), local.z};
  s.dn_du = s.dp_du * (side / transform_vector(m, {1, 0, 0}).length());
  return s;
}

}  // namespace warpath
