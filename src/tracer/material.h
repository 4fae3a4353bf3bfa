#pragma once
#include <cstdint>
#include <memory>

#include "core/math.h"
#include "path/primary_source.h"
#include "scene/scene.h"

namespace warpath {

/// A point on a surface as the tracer finds it. World space.
struct SurfacePoint {
  Vec3 ng;  ///< geometric normal, unit, as the shape's orientation gives it (not turned towards wi)
  Vec3 ns;  ///< shading normal, unit, likewise
  Vec3 wi;  ///< unit, towards the previous vertex
  Vec2 uv;
  Vec3 dp_du, dp_dv;  ///< only where Materials::needs_tangents(bsdf), else undefined
  Vec3 dn_du, dn_dv;  ///< change of the shading normal with uv, likewise
  /// A mesh whose texture coordinates run the other way round: dp_du x dp_dv points away from ng. Never set for
  /// analytic shapes, whose tangent frame is (dp_du, ns x dp_du, ns) in Mitsuba.
  bool left_handed = false;
};

struct BsdfSample {
  Vec3 wo;        ///< unit, world space
  Color weight;   ///< f |cos| / pdf; 0 if sampling failed
  float pdf = 0;  ///< solid angle, of all lobes that can make wo; 1 (times the lobe's probability) for a delta lobe
  float eta = 1;  ///< relative index of refraction along wo, for roulette
  bool delta = false;  ///< Mitsuba's Delta or Null: light sampling cannot make this direction
  bool null = false;   ///< passed straight through
};

/// One BSDF at one point: nested BSDFs resolved, textures looked up, frame built. Plain data; lives for one bounce.
struct Scatter;    // in scatter.h
struct PlainBsdf;  // in plain_bsdf.h

/// The scene's BSDFs, compiled for rendering. Immutable, thread-safe.
class Materials {
 public:
  /// Compiles the scene's BSDFs and shares its images. Throws SceneError where a BSDF nests more than Scatter holds.
  explicit Materials(const Scene& scene);
  ~Materials();
  /// True where the frame or the BSDF depends on the direction of u: anisotropic, bump- or normal-mapped.
  bool needs_tangents(BsdfId bsdf) const;
  bool needs_uv(BsdfId bsdf) const;  ///< true if any texture below it is not constant
  void at(BsdfId bsdf, const SurfacePoint& point, Scatter& scatter) const;
  /// Starts loading the texels that at() will read; to be called a while before it.
  void prefetch(BsdfId bsdf, const Vec2& uv) const;
  Color texture(TextureId id, Vec2 uv) const;
  /// The BSDF as a plain one, or null if it is more than that.
  const PlainBsdf* plain(BsdfId bsdf) const;
  /// Whether that one's reflectance is the same everywhere.
  bool is_constant(TextureId id) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> m_impl;
};

/// f(wi, wo) |cos theta_o| of all non-delta lobes, and the solid-angle density with which sample_bsdf makes wo.
Color eval_pdf_bsdf(const Scatter& scatter, const Vec3& wo, float& pdf);
/// lobe chooses the lobe (blend, mask and lobe share it: it is rescaled), dir the direction within it.
BsdfSample sample_bsdf(const Scatter& scatter, float lobe, const Vec2& dir);
/// Has it any lobe that light sampling can reach?
bool is_smooth(const Scatter& scatter);
/// For guiding and AOVs: approximate hemispherical reflectance (plus transmittance), roughness 0 (delta) to 1
/// (diffuse).
Color albedo(const Scatter& scatter);
float roughness(const Scatter& scatter);
SurfaceKind kind(const Scatter& scatter);
/// The shading normal that the BSDF uses (after bump and normal maps), on the side of wi.
Vec3 shading_normal(const Scatter& scatter);

}  // namespace warpath
