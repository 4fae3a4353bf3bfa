#pragma once
#include "tracer/bsdf_dielectric.h"
#include "tracer/microfacet.h"

namespace warpath {

template <>
struct Lobe<RoughDielectric> {
  struct Values {
    Color reflectance, transmittance;
    float alpha_u, alpha_v;
  };
  Lobe(const RoughDielectric& description, LobeContext&) : bsdf(description) {}
  LobeInputs inputs() const {
    return {{bsdf.specular_reflectance, bsdf.specular_transmittance},
            {bsdf.alpha_u, bsdf.alpha_v},
            bsdf.alpha_u != bsdf.alpha_v};
  }
  LobeEval eval(const Values& v, const Vec3& wi, const Vec3& wo) const;
  LobeSample sample(const Values& v, const Vec3& wi, float u, const Vec2& dir) const;
  Color albedo(const Values& v, const Vec3& wi) const {
    return dielectric_albedo(v.reflectance, v.transmittance, wi.z, bsdf.eta);
  }
  float roughness(const Values& v) const { return roughness_of_alpha(v.alpha_u, v.alpha_v); }
  SurfaceKind kind(const Values&) const { return SurfaceKind::glossy; }

  RoughDielectric bsdf;
};

}  // namespace warpath
