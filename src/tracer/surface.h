#pragma once
#include <memory>
#include <span>
#include <vector>

#include "scene/scene.h"
#include "tracer/analytic_shape.h"
#include "tracer/material.h"
#include "tracer/ray_stream.h"

namespace warpath {

/// The scene's shapes as shading sees them: from a hit to a SurfacePoint. Refers to the scene's buffers.
class Surfaces {
 public:
  Surfaces(std::span<const Shape> shapes, const Materials& materials);

  /// Fills `point` for hit i of a stream and returns its position. Texture coordinates and tangents are only computed
  /// where the shape's BSDF or emitter needs them.
  Vec3 at(const HitStream& hits, std::size_t i, const RayStream& rays, SurfacePoint& point) const;

  /// Starts loading what at() will read for hit i: first the triangle, and when that is there its vertices.
  void prefetch_triangle(const HitStream& hits, std::size_t i) const;
  void prefetch_vertices(const HitStream& hits, std::size_t i) const;

  BsdfId bsdf(std::uint32_t shape) const { return m_shapes[shape].bsdf; }
  std::int32_t emitter(std::uint32_t shape) const { return m_shapes[shape].emitter; }
  /// analytic()[i] is shape i if that is a sphere, disk or cylinder, else null.
  std::span<const AnalyticShape* const> analytic() const { return m_analytic; }
  bool any_moves() const { return m_any_moves; }

 private:
  struct Entry {
    const Mesh* mesh = nullptr;
    // Of the mesh: its buffers, or null where it has none.
    const std::uint32_t* indices = nullptr;
    const Vec3* normals = nullptr;
    const Vec2* uvs = nullptr;
    float side = 1;      // -1 under flip_normals
    bool moves = false;  // so that its normals do
    const Rectangle* rectangle = nullptr;
    const AnalyticShape* analytic = nullptr;
    Vec3 rectangle_normal;  // of a rectangle that stands still
    BsdfId bsdf = -1;
    std::int32_t emitter = -1;
    bool needs_uv = false, needs_tangents = false;
  };
  void mesh_at(const Entry& shape, std::uint32_t primitive, float u, float v, float time, SurfacePoint& point) const;
  void rectangle_at(const Entry& shape, std::uint32_t primitive, float u, float v, float time,
                    SurfacePoint& point) const;

  std::vector<Entry> m_shapes;
  std::vector<std::unique_ptr<const AnalyticShape>> m_owned;
  std::vector<const AnalyticShape*> m_analytic;
  bool m_any_moves = false;
};

/// Unit normal of a rectangle, flip_normals applied.
Vec3 rectangle_normal(const Rectangle& rectangle, float time);
/// The rectangle's matrix at a time within the shutter.
Matrix4 rectangle_matrix(const Rectangle& rectangle, float time);

/// Offsets of spawned rays, as Mitsuba 3's math::RayEpsilon and ShadowEpsilon in float32: 1500 roundings of 1, and ten
/// times that.
inline constexpr float kRayEpsilon = 1500 * 0x1p-24f;
inline constexpr float kShadowEpsilon = 10 * kRayEpsilon;

/// Where a ray along `direction` starts that leaves the surface at p: pushed off along the geometric normal.
inline Vec3 offset_point(const Vec3& p, const Vec3& ng, const Vec3& direction) {
  const float largest = larger(std::fabs(p.x), larger(std::fabs(p.y), std::fabs(p.z)));
  return p + ng * std::copysign((1 + largest) * kRayEpsilon, ng.dot(direction));
}

}  // namespace warpath
