#include "tracer/area_light.h"

#include <algorithm>
#include <limits>

#include "tracer/frame.h"
#include "tracer/sample_square_to_hemisphere.h"
#include "tracer/sampling.h"
#include "tracer/surface.h"

namespace warpath {
namespace {

constexpr float kFloor = 0.1f;  // share of a textured light's samples that ignore the texture

// Area of the image of the unit disk or the square [-1,1]^2 over pi or 4.
float plane_scale(const Matrix4& m) {
  return transform_vector(m, {1, 0, 0}).cross(transform_vector(m, {0, 1, 0})).length();
}

// Samples lie evenly on the surface only if x and y are scaled alike; the density is exact for that.
float cylinder_area(const Matrix4& m) {
  return 2 * kPi * transform_vector(m, {1, 0, 0}).length() * transform_vector(m, {0, 0, 1}).length();
}

// How large a sphere looks from outside: true and 1 - cos of the half-angle of its cone.
bool visible_cone(float distance2, float radius, bool flipped, float& sin2_max, float& cos_max, float& one_minus_cos) {
  const float edge = radius * (flipped ? 1 + kRayEpsilon : 1 - kRayEpsilon);
  if (!(distance2 > edge * edge)) return false;
  sin2_max = smaller(radius * radius / distance2, 1.0f);
  cos_max = std::sqrt(1 - sin2_max);
  one_minus_cos = sin2_max / (1 + cos_max);
  return true;
}

// From an area density at a point to a solid-angle density; 0 if the surface is seen edge on.
float to_solid_angle(float pdf_area, const Vec3& wo, float distance, const Vec3& ng) {
  const float cosine = std::fabs(wo.dot(ng));
  return cosine > 0 ? pdf_area * distance * distance / cosine : 0.0f;
}

}  // namespace

AreaLight::AreaLight(const Shape& shape, const AnalyticShape* analytic, TextureId radiance, const Texture& texture,
                     const Materials& materials)
    : m_mesh(std::get_if<Mesh>(&shape.geometry)),
      m_rectangle(std::get_if<Rectangle>(&shape.geometry)),
      m_analytic(analytic),
      m_textured(!std::holds_alternative<ConstantTexture>(texture)) {
  if (m_mesh) {
    m_moves = !m_mesh->positions_end.empty();
    std::vector<float> weights(m_mesh->triangle_count());
    double area = 0, power = 0;
    for (std::uint32_t t = 0; t < weights.size(); ++t) area += weights[t] = triangle_area(t, 0);
    m_inverse_area = static_cast<float>(1 / area);
    if (m_textured && !m_mesh->uvs.empty()) {
      m_uniform = false;
      for (std::uint32_t t = 0; t < weights.size(); ++t) {
        const std::uint32_t* i = &m_mesh->indices[3 * t];
        const Vec2 a = m_mesh->uvs[i[0]], b = m_mesh->uvs[i[1]], c = m_mesh->uvs[i[2]];
        float sum = 0;
        constexpr int kSide = 8;
        for (int y = 0; y < kSide; ++y)
          for (int x = 0; x < kSide; ++x) {
            const Vec2 w = sample_triangle({(x + 0.5f) / kSide, (y + 0.5f) / kSide});
            sum += luminance(materials.texture(radiance, a * (1 - w.x - w.y) + b * w.x + c * w.y));
          }
        power += weights[t] *= sum / (kSide * kSide);
      }
      for (std::uint32_t t = 0; t < weights.size(); ++t)
        weights[t] += kFloor * static_cast<float>(power / area) * triangle_area(t, 0);
    }
    m_triangles = DiscreteDistribution(weights);
  } else if (m_rectangle) {
    m_moves = m_rectangle->to_world[0] != m_rectangle->to_world[1];
    m_matrix = m_rectangle->to_world[0];
    m_normal = rectangle_normal(*m_rectangle, 0);
    m_inverse_area = 1 / (4 * plane_scale(m_matrix));
    if (m_textured) weigh_rectangle(radiance, texture, materials);
  } else {
    m_moves = m_analytic->moves();
    m_matrix = m_analytic->to_world(0);
    switch (m_analytic->kind()) {
      case AnalyticShape::Kind::sphere:
        m_inverse_area = 1 / (4 * kPi * sqr(m_analytic->radius(0)));
        break;
      case AnalyticShape::Kind::disk:
        m_inverse_area = 1 / (kPi * plane_scale(m_matrix));
        m_normal = m_analytic->at(transform_point(m_matrix, {0, 0, 0}), 0).normal;
        break;
      case AnalyticShape::Kind::cylinder:
        m_inverse_area = 1 / cylinder_area(m_matrix);
        break;
    }
  }
}

void AreaLight::weigh_rectangle(TextureId radiance, const Texture& texture, const Materials& materials) {
  int width = 64, height = 64;
  if (const auto* bitmap = std::get_if<BitmapTexture>(&texture)) {
    width = std::clamp(bitmap->image->width, 2, 512);
    height = std::clamp(bitmap->image->height, 2, 512);
  }
  std::vector<float> nodes;
  nodes.reserve(static_cast<std::size_t>(width + 1) * (height + 1));
  double sum = 0;
  for (int y = 0; y <= height; ++y)
    for (int x = 0; x <= width; ++x) {
      float value = 0;  // of the four quarters of cells around the node
      for (const float dy : {-0.25f, 0.25f})
        for (const float dx : {-0.25f, 0.25f}) {
          const Vec2 uv(clamp01((static_cast<float>(x) + dx) / width), clamp01((static_cast<float>(y) + dy) / height));
          value += 0.25f * luminance(materials.texture(radiance, uv));
        }
      nodes.push_back(value);
      sum += value;
    }
  const float floor = kFloor * static_cast<float>(sum / static_cast<double>(nodes.size()));
  for (float& node : nodes) node += floor;
  m_over_uv = BilinearDistribution(std::move(nodes), width + 1, height + 1);
  m_uniform = false;
}

float AreaLight::triangle_area(std::uint32_t triangle, float time) const {
  const std::uint32_t* i = &m_mesh->indices[3 * static_cast<std::size_t>(triangle)];
  Vec3 p[3];
  for (int k = 0; k < 3; ++k) {
    p[k] = m_mesh->positions[i[k]];
    if (time > 0 && !m_mesh->positions_end.empty()) p[k] = lerp(p[k], m_mesh->positions_end[i[k]], time);
  }
  return 0.5f * (p[1] - p[0]).cross(p[2] - p[0]).length();
}

bool AreaLight::sample_mesh(Vec2 u, float time, Vec3& p, Vec3& ng, LightPoint& point, float& pdf_area) const {
  const auto triangle = static_cast<std::uint32_t>(m_triangles.sample(u.y, u.y));
  const std::uint32_t* i = &m_mesh->indices[3 * static_cast<std::size_t>(triangle)];
  Vec3 v[3];
  for (int k = 0; k < 3; ++k)
    v[k] = m_moves ? lerp(m_mesh->positions[i[k]], m_mesh->positions_end[i[k]], time) : m_mesh->positions[i[k]];
  const Vec2 b = sample_triangle(u);
  const float b0 = 1 - b.x - b.y, side = m_mesh->flip_normals ? -1.0f : 1.0f;
  p = v[0] * b0 + v[1] * b.x + v[2] * b.y;
  ng = (v[1] - v[0]).cross(v[2] - v[0]);
  const float twice_area = ng.length();
  if (!(twice_area > 0)) return false;
  ng *= side / twice_area;
  pdf_area = m_uniform && !m_moves ? m_inverse_area : m_triangles.probability(triangle) * 2 / twice_area;
  point.ns = ng;
  if (!m_mesh->normals.empty()) {
    const auto normal = [&](int k) {
      const Vec3& n = m_mesh->normals[i[k]];
      return m_mesh->normals_end.empty() ? n : lerp(n, m_mesh->normals_end[i[k]], time);
    };
    point.ns = (normal(0) * b0 + normal(1) * b.x + normal(2) * b.y).normalized() * side;
  }
  if (m_mesh->uvs.empty())
    point.uv = m_mesh->flip_normals ? Vec2(b.x, b0) : b;
  else
    point.uv = m_mesh->uvs[i[0]] * b0 + m_mesh->uvs[i[1]] * b.x + m_mesh->uvs[i[2]] * b.y;
  return true;
}

// [Akalin 2015, Sampling the visible sphere]; near 0 the half-angle's cosine would cancel, so 1 - cos comes from the
// sine.
bool AreaLight::sample_sphere_cone(const Vec3& from, const Vec2& u, float time, LightPoint& point) const {
  const Vec3 center = m_analytic->center(time);
  const float radius = m_analytic->radius(time);
  const Vec3 to_center = center - from;
  const float distance2 = to_center.dot(to_center);
  float sin2_max, cos_max, one_minus_cos;
  Vec3 outwards;
  if (visible_cone(distance2, radius, m_analytic->flip_normals(), sin2_max, cos_max, one_minus_cos)) {
    const float drop = one_minus_cos * u.x;  // 1 - cos theta
    const float sin2 = larger(0.0f, drop * (2 - drop)), cosine = 1 - drop;
    const float inverse_sin_max = 1 / std::sqrt(sin2_max);
    const float cos_alpha = sin2 * inverse_sin_max + cosine * std::sqrt(larger(0.0f, 1 - sin2 * sqr(inverse_sin_max)));
    const float sin_alpha = std::sqrt(larger(0.0f, 1 - cos_alpha * cos_alpha));
    const float phi = 2 * kPi * u.y;
    const Frame frame = frame_of_normal(to_center * (-1 / std::sqrt(distance2)));
    outwards = frame.to_world({std::cos(phi) * sin_alpha, std::sin(phi) * sin_alpha, cos_alpha});
    point.pdf = 1 / (2 * kPi * one_minus_cos);
  } else {
    outwards = warpath::sample_sphere(u);
    point.pdf = 0;
  }
  const Vec3 d = center + outwards * radius - from;
  point.distance = d.length();
  if (!(point.distance > 0)) return false;
  point.wo = d / point.distance;
  if (point.pdf == 0) point.pdf = to_solid_angle(1 / (4 * kPi * sqr(radius)), point.wo, point.distance, outwards);
  point.ns = m_analytic->flip_normals() ? -outwards : outwards;
  return point.pdf > 0;
}

bool AreaLight::sample(const Vec3& from, const Vec2& u, float time, LightPoint& point) const {
  Vec3 p, ng;
  float pdf_area = 0;
  if (m_mesh) {
    if (!sample_mesh(u, time, p, ng, point, pdf_area)) return false;
  } else if (m_rectangle) {
    float density = 1;
    point.uv = m_uniform ? u : m_over_uv.sample(u, density);
    const Vec3 local(2 * point.uv.x - 1, 2 * point.uv.y - 1, 0);
    if (m_moves) {
      const Matrix4 m = rectangle_matrix(*m_rectangle, time);
      p = transform_point(m, local);
      ng = rectangle_normal(*m_rectangle, time);
      pdf_area = density / (4 * plane_scale(m));
    } else {
      p = transform_point(m_matrix, local);
      ng = m_normal;
      pdf_area = density * m_inverse_area;
    }
    point.ns = ng;
  } else if (m_analytic->kind() == AnalyticShape::Kind::sphere) {
    if (!sample_sphere_cone(from, u, time, point)) return false;
    if (m_textured) point.uv = m_analytic->at(from + point.wo * point.distance, time).uv;
    return true;
  } else {
    const Matrix4 m = m_moves ? m_analytic->to_world(time) : m_matrix;
    Vec3 local;
    if (m_analytic->kind() == AnalyticShape::Kind::disk) {
      const Vec2 at = square_to_disk(u);
      local = {at.x, at.y, 0};
      pdf_area = m_moves ? 1 / (kPi * plane_scale(m)) : m_inverse_area;
    } else {
      const float phi = 2 * kPi * u.y;
      local = {std::cos(phi), std::sin(phi), u.x};
      pdf_area = m_moves ? 1 / cylinder_area(m) : m_inverse_area;
    }
    p = transform_point(m, local);
    const AnalyticShape::Surface surface = m_analytic->at(p, time);
    ng = point.ns = surface.normal;
    point.uv = surface.uv;
  }
  const Vec3 d = p - from;
  const float distance2 = d.dot(d);
  if (!(distance2 > 0)) return false;
  point.distance = std::sqrt(distance2);
  point.wo = d * (1 / point.distance);
  point.pdf = to_solid_angle(pdf_area, point.wo, point.distance, ng);
  return point.pdf > 0;
}

bool AreaLight::is_plain_rectangle(RectangleLights::Light& light) const {
  if (!m_rectangle || m_moves || m_textured) return false;
  light.edge_u = transform_vector(m_matrix, {2, 0, 0});
  light.edge_v = transform_vector(m_matrix, {0, 2, 0});
  light.corner = transform_point(m_matrix, {-1, -1, 0});
  light.normal = m_normal;
  light.inverse_area = m_inverse_area;
  return true;
}

float AreaLight::pdf(const Vec3& from, const Vec3& to, const Vec3& ng, const Vec2& uv, std::uint32_t primitive,
                     float time) const {
  const Vec3 d = to - from;
  const float distance = d.length();
  const Vec3 wo = d / distance;
  if (m_mesh) {
    if (m_uniform && !m_moves) return to_solid_angle(m_inverse_area, wo, distance, ng);
    const float area = triangle_area(primitive, time);
    return area > 0 ? to_solid_angle(m_triangles.probability(primitive) / area, wo, distance, ng) : 0.0f;
  }
  if (m_rectangle) {
    const float density = m_uniform ? 1.0f : m_over_uv.pdf(uv);
    const float inverse_area = m_moves ? 1 / (4 * plane_scale(rectangle_matrix(*m_rectangle, time))) : m_inverse_area;
    return to_solid_angle(density * inverse_area, wo, distance, ng);
  }
  switch (m_analytic->kind()) {
    case AnalyticShape::Kind::sphere: {
      const float radius = m_analytic->radius(time);
      const Vec3 to_center = m_analytic->center(time) - from;
      float sin2_max, cos_max, one_minus_cos;
      if (visible_cone(to_center.dot(to_center), radius, m_analytic->flip_normals(), sin2_max, cos_max, one_minus_cos))
        return 1 / (2 * kPi * one_minus_cos);
      return to_solid_angle(1 / (4 * kPi * sqr(radius)), wo, distance, ng);
    }
    case AnalyticShape::Kind::disk:
      return to_solid_angle(m_moves ? 1 / (kPi * plane_scale(m_analytic->to_world(time))) : m_inverse_area, wo,
                            distance, ng);
    case AnalyticShape::Kind::cylinder:
      return to_solid_angle(m_moves ? 1 / cylinder_area(m_analytic->to_world(time)) : m_inverse_area, wo, distance, ng);
  }
  return 0;
}

}  // namespace warpath
