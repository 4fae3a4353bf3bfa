#include "tracer/surface.h"

#include "tracer/sampling.h"

namespace warpath {
namespace {

// (dp_du, dp_dv) from the change of p along the two barycentric axes. Zero where the texture coordinates are
// degenerate.
void to_uv_basis(const Vec2& duv1, const Vec2& duv2, const Vec3& d1, const Vec3& d2, Vec3& along_u, Vec3& along_v) {
  const float determinant = duv1.x * duv2.y - duv1.y * duv2.x;
  const float inverse = determinant != 0 ? 1 / determinant : 0.0f;
  along_u = (d1 * duv2.y - d2 * duv1.y) * inverse;
  along_v = (d2 * duv1.x - d1 * duv2.x) * inverse;
}

}  // namespace

Matrix4 rectangle_matrix(const Rectangle& rectangle, float time) {
  return rectangle.to_world[0] == rectangle.to_world[1] ? rectangle.to_world[0]
                                                        : lerp(rectangle.to_world[0], rectangle.to_world[1], time);
}
Vec3 rectangle_normal(const Rectangle& rectangle, float time) {
  const Vec3 up(0, 0, rectangle.flip_normals ? -1.0f : 1.0f);
  return transform_normal(rectangle_matrix(rectangle, time).inverse(), up).normalized();
}

Surfaces::Surfaces(std::span<const Shape> shapes, const Materials& materials) {
  m_analytic.resize(shapes.size());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const Shape& shape = shapes[i];
    Entry& entry = m_shapes.emplace_back();
    entry.bsdf = shape.bsdf;
    entry.emitter = shape.emitter;
    entry.needs_tangents = shape.bsdf >= 0 && materials.needs_tangents(shape.bsdf);
    entry.needs_uv = entry.needs_tangents || shape.emitter >= 0 || (shape.bsdf >= 0 && materials.needs_uv(shape.bsdf));
    if ((entry.mesh = std::get_if<Mesh>(&shape.geometry))) {
      const Mesh& mesh = *entry.mesh;
      entry.indices = mesh.indices.data();
      entry.normals = mesh.normals.empty() ? nullptr : mesh.normals.data();
      entry.uvs = mesh.uvs.empty() ? nullptr : mesh.uvs.data();
      entry.side = mesh.flip_normals ? -1.0f : 1.0f;
      entry.moves = !mesh.normals_end.empty();
      m_any_moves |= !mesh.positions_end.empty();
    } else if ((entry.rectangle = std::get_if<Rectangle>(&shape.geometry))) {
      entry.rectangle_normal = warpath::rectangle_normal(*entry.rectangle, 0);
      m_any_moves |= entry.rectangle->to_world[0] != entry.rectangle->to_world[1];
    } else {
      if (const auto* sphere = std::get_if<Sphere>(&shape.geometry))
        m_owned.push_back(std::make_unique<AnalyticShape>(*sphere));
      else if (const auto* disk = std::get_if<Disk>(&shape.geometry))
        m_owned.push_back(std::make_unique<AnalyticShape>(*disk));
      else
        m_owned.push_back(std::make_unique<AnalyticShape>(std::get<Cylinder>(shape.geometry)));
      m_analytic[i] = entry.analytic = m_owned.back().get();
      m_any_moves |= entry.analytic->moves();
    }
  }
}

Vec3 Surfaces::at(const HitStream& hits, std::size_t i, const RayStream& rays, SurfacePoint& point) const {
  const Entry& shape = m_shapes[hits.shape[i]];
  const Vec3 position = rays.origin(i) + rays.direction(i) * hits.t[i];
  point.wi = -rays.direction(i);
  if (shape.mesh) {
    point.ng = unit({hits.nx[i], hits.ny[i], hits.nz[i]});
    mesh_at(shape, hits.primitive[i], hits.u[i], hits.v[i], rays.time[i], point);
    return position;
  }
  if (shape.rectangle) {
    rectangle_at(shape, hits.primitive[i], hits.u[i], hits.v[i], rays.time[i], point);
    return position;
  }
  const AnalyticShape::Surface surface = shape.analytic->at(position, rays.time[i]);
  point.ng = point.ns = surface.normal;
  point.uv = surface.uv;
  point.dp_du = surface.dp_du, point.dp_dv = surface.dp_dv;
  point.dn_du = surface.dn_du, point.dn_dv = surface.dn_dv;
  point.left_handed = false;
  return surface.position;
}

void Surfaces::prefetch_triangle(const HitStream& hits, std::size_t i) const {
  if (hits.shape[i] == kNoHit) return;
  const Entry& shape = m_shapes[hits.shape[i]];
  if (shape.indices) __builtin_prefetch(shape.indices + 3 * static_cast<std::size_t>(hits.primitive[i]));
}

void Surfaces::prefetch_vertices(const HitStream& hits, std::size_t i) const {
  if (hits.shape[i] == kNoHit) return;
  const Entry& shape = m_shapes[hits.shape[i]];
  if (!shape.indices) return;
  const std::uint32_t* index = shape.indices + 3 * static_cast<std::size_t>(hits.primitive[i]);
  if (shape.normals)
    for (int k = 0; k < 3; ++k) __builtin_prefetch(shape.normals + index[k]);
  if (shape.needs_uv && shape.uvs)
    for (int k = 0; k < 3; ++k) __builtin_prefetch(shape.uvs + index[k]);
}

void Surfaces::mesh_at(const Entry& shape, std::uint32_t primitive, float u, float v, float time,
                       SurfacePoint& point) const {
  const std::uint32_t* index = shape.indices + 3 * static_cast<std::size_t>(primitive);
  const std::uint32_t i0 = index[0], i1 = index[1], i2 = index[2];
  point.ng *= shape.side;

  Vec3 dn1(0), dn2(0);  // change of the shading normal along the barycentric axes
  if (!shape.normals) {
    point.ns = point.ng;
  } else {
    Vec3 n0 = shape.normals[i0], n1 = shape.normals[i1], n2 = shape.normals[i2];
    if (shape.moves) {
      const Mesh& mesh = *shape.mesh;
      n0 = lerp(n0, mesh.normals_end[i0], time);
      n1 = lerp(n1, mesh.normals_end[i1], time);
      n2 = lerp(n2, mesh.normals_end[i2], time);
    }
    const Vec3 n = n0 * (1 - u - v) + n1 * u + n2 * v;
    const float inverse_length = shape.side / std::sqrt(n.dot(n));
    point.ns = n * inverse_length;
    if (shape.needs_tangents) {
      const auto project = [&](const Vec3& d) { return d - point.ns * point.ns.dot(d); };
      dn1 = project((n1 - n0) * inverse_length);
      dn2 = project((n2 - n0) * inverse_length);
    }
  }

  if (!shape.needs_uv) return;
  Vec2 duv1(1, 0), duv2(0, 1);
  if (!shape.uvs) {
    // Mitsuba turns a triangle by naming its vertices backwards, which changes who is first.
    const bool backwards = shape.side < 0;
    point.uv = backwards ? Vec2(u, 1 - u - v) : Vec2(u, v);
    if (backwards) duv1 = {1, -1}, duv2 = {0, -1};
  } else {
    const Vec2 uv0 = shape.uvs[i0];
    duv1 = shape.uvs[i1] - uv0;
    duv2 = shape.uvs[i2] - uv0;
    point.uv = uv0 + duv1 * u + duv2 * v;
  }
  if (!shape.needs_tangents) return;
  const Mesh& mesh = *shape.mesh;
  Vec3 p0 = mesh.positions[i0], p1 = mesh.positions[i1], p2 = mesh.positions[i2];
  if (!mesh.positions_end.empty()) {
    p0 = lerp(p0, mesh.positions_end[i0], time);
    p1 = lerp(p1, mesh.positions_end[i1], time);
    p2 = lerp(p2, mesh.positions_end[i2], time);
  }
  to_uv_basis(duv1, duv2, p1 - p0, p2 - p0, point.dp_du, point.dp_dv);
  point.left_handed = point.dp_du.cross(point.dp_dv).dot(point.ng) < 0;
  to_uv_basis(duv1, duv2, dn1, dn2, point.dn_du, point.dn_dv);
}

void Surfaces::rectangle_at(const Entry& shape, std::uint32_t primitive, float u, float v, float time,
                            SurfacePoint& point) const {
  const Rectangle& rectangle = *shape.rectangle;
  const bool moves = rectangle.to_world[0] != rectangle.to_world[1];
  point.ng = point.ns = moves ? warpath::rectangle_normal(rectangle, time) : shape.rectangle_normal;
  if (!shape.needs_uv) return;
  // The triangles are (00, 10, 01) and (10, 11, 01).
  point.uv = primitive == 0 ? Vec2(u, v) : Vec2(1 - v, u + v);
  if (!shape.needs_tangents) return;
  const Matrix4 m = rectangle_matrix(rectangle, time);
  point.dp_du = transform_vector(m, {2, 0, 0});
  point.dp_dv = transform_vector(m, {0, 2, 0});
  point.dn_du = point.dn_dv = Vec3(0);
  point.left_handed = false;
}

}  // namespace warpath
