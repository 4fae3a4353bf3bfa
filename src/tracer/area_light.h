#pragma once
#include <vector>

#include "scene/scene.h"
#include "tracer/analytic_shape.h"
#include "tracer/distribution.h"
#include "tracer/light_samples.h"
#include "tracer/material.h"

namespace warpath {

/// A direction from a reference point towards a point on a light's surface.
struct LightPoint {
  Vec3 wo;             ///< unit
  float distance = 0;  ///< infinite for lights at infinity
  float pdf = 0;       ///< solid angle, as seen from the reference point
  Vec3 ns;             ///< shading normal of the light there, unit
  Vec2 uv;             ///< texture coordinates there; undefined if the light is not textured
};

/// How points are chosen on a shape that emits, so that lights are sampled by what is seen of them: spheres by their
/// visible cone, all others by area, textured ones in proportion to the texture. Refers to the shape's buffers.
class AreaLight {
 public:
  AreaLight(const Shape& shape, const AnalyticShape* analytic, TextureId radiance, const Texture& texture,
            const Materials& materials);

  /// A point on the shape from u, or false if there is none that `from` could see.
  bool sample(const Vec3& from, const Vec2& u, float time, LightPoint& point) const;
  /// If it is a rectangle at rest whose radiance is the same everywhere: sets where it is.
  bool is_plain_rectangle(RectangleLights::Light& light) const;
  /// Density with which sample() makes the direction from `from` to the point `to` with geometric normal ng.
  float pdf(const Vec3& from, const Vec3& to, const Vec3& ng, const Vec2& uv, std::uint32_t primitive,
            float time) const;

 private:
  bool sample_mesh(Vec2 u, float time, Vec3& p, Vec3& ng, LightPoint& point, float& pdf_area) const;
  bool sample_sphere_cone(const Vec3& from, const Vec2& u, float time, LightPoint& point) const;
  float triangle_area(std::uint32_t triangle, float time) const;
  void weigh_rectangle(TextureId radiance, const Texture& texture, const Materials& materials);

  const Mesh* m_mesh = nullptr;
  const Rectangle* m_rectangle = nullptr;
  const AnalyticShape* m_analytic = nullptr;
  DiscreteDistribution m_triangles;
  BilinearDistribution m_over_uv;  // of a textured rectangle
  bool m_textured;
  bool m_uniform = true;     // over the area
  float m_inverse_area = 0;  // of a shape that stands still
  bool m_moves = false;
  Matrix4 m_matrix;  // of a rectangle, disk or cylinder that stands still
  Vec3 m_normal;     // of a rectangle or disk that stands still
};

}  // namespace warpath
