#pragma once
#include "tracer/lobe.h"

namespace warpath {

/// What plastic and roughplastic have in common: a diffuse base under a dielectric surface.
template <class Bsdf>
struct PlasticLobe {
  struct Values {
    Color diffuse, specular;
  };
  PlasticLobe(const Bsdf& bsdf, const TextureLookup& textures);
  LobeInputs inputs() const { return {{bsdf.diffuse_reflectance, bsdf.specular_reflectance}, {}}; }
  SurfaceKind kind(const Values&) const { return SurfaceKind::mixed; }

  /// Probability of the specular lobe when `transmitted` of the light enters the base.
  float specular_probability(float transmitted) const {
    const float specular = (1 - transmitted) * specular_sampling_weight;
    const float diffuse = transmitted * (1 - specular_sampling_weight);
    return specular + diffuse > 0 ? specular / (specular + diffuse) : 1;
  }

  /// The base's reflectance after all bounces between it and the surface, with the change of solid angle on the way
  /// out.
  Color base_reflectance(const Color& d) const {
    const float inv_eta2 = 1 / (bsdf.eta * bsdf.eta), r = internal_reflectance;
    if (!bsdf.nonlinear) return d * (inv_eta2 / (1 - r));
    return {d.x * inv_eta2 / (1 - d.x * r), d.y * inv_eta2 / (1 - d.y * r), d.z * inv_eta2 / (1 - d.z * r)};
  }

  /// Where `transmitted` of the light enters the base.
  Color albedo_of(const Values& v, float transmitted) const;

  Bsdf bsdf;
  float specular_sampling_weight;  ///< mean specular over mean specular and diffuse reflectance
  float internal_reflectance = 0;  ///< of diffuse light from within
};

template <>
struct Lobe<Plastic> : PlasticLobe<Plastic> {
  Lobe(const Plastic& bsdf, LobeContext& context);
  LobeEval eval(const Values& v, const Vec3& wi, const Vec3& wo) const;
  LobeSample sample(const Values& v, const Vec3& wi, float u, const Vec2& dir) const;
  Color albedo(const Values& v, const Vec3& wi) const { return albedo_of(v, transmittance(std::fabs(wi.z))); }
  float roughness(const Values&) const { return 0.5f; }  // base and surface share what a path sees about evenly

  float transmittance(float cosine) const;  ///< share of the light from a direction that passes the surface
};

}  // namespace warpath
