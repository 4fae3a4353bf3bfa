#pragma once
#include <cstddef>

#include "path/primary_source.h"
#include "scene/scene.h"
#include "tracer/bsdf_rough_plastic.h"
#include "tracer/vec3_array.h"

namespace warpath {

/// What most surfaces are made of: one diffuse or rough plastic lobe around the shading normal, alone or under a
/// twosided BSDF. Many vertices of such a material are shaded at once, with SIMD; the same functions as eval_pdf_bsdf
/// and sample_bsdf up to rounding.
struct PlainBsdf {
  const Lobe<RoughPlastic>* plastic;  ///< with sample_visible; null: diffuse
  TextureId reflectance;              ///< of what is diffuse
  Color specular;                     ///< reflectance of rough plastic's surface
  bool two_sided;
};

/// What a plain BSDF knows of its vertices.
struct PlainVertices {
  Vec3Array normal;       ///< for shading, unit, not turned towards wi
  Vec3Array wi;           ///< unit
  Vec3Array reflectance;  ///< looked up
};

/// For guiding, as albedo, roughness and kind of a Scatter; cos_theta_i may be negative.
Color plain_albedo(const PlainBsdf& bsdf, float cos_theta_i, const Color& reflectance);
float plain_roughness(const PlainBsdf& bsdf);
SurfaceKind plain_kind(const PlainBsdf& bsdf);

// These work on vertices [begin, end) and may overwrite what follows them, up to Arena::kPad entries: do the vertices
// of a batch from the first to the last.

/// f |cos theta_o| and the density with which sample_plain makes wo.
void eval_plain(const PlainBsdf& bsdf, const PlainVertices& vertices, std::size_t begin, std::size_t end,
                const Vec3Array& wo, const Vec3Array& value, float* pdf);
/// Directions from the numbers lobe and dir; f |cos theta_o| / pdf; 0 and 0 where sampling failed.
void sample_plain(const PlainBsdf& bsdf, const PlainVertices& vertices, std::size_t begin, std::size_t end,
                  const float* lobe, const float* dir_u, const float* dir_v, const Vec3Array& wo,
                  const Vec3Array& weight, float* pdf);

}  // namespace warpath
