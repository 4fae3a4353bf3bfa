#pragma once
#include "tracer/fresnel.h"
#include "tracer/lobe.h"
#include "tracer/microfacet.h"

namespace warpath {

template <>
struct Lobe<RoughConductor> {
  struct Values {
    Color reflectance;
    float alpha_u, alpha_v;
  };
  Lobe(const RoughConductor& description, LobeContext&) : bsdf(description) {}
  LobeInputs inputs() const {
    return {{bsdf.specular_reflectance}, {bsdf.alpha_u, bsdf.alpha_v}, bsdf.alpha_u != bsdf.alpha_v};
  }
  LobeEval eval(const Values& v, const Vec3& wi, const Vec3& wo) const;
  LobeSample sample(const Values& v, const Vec3& wi, float u, const Vec2& dir) const;
  Color albedo(const Values& v, const Vec3& wi) const {
    return v.reflectance * fresnel_conductor(std::fabs(wi.z), bsdf.eta, bsdf.k);
  }
  float roughness(const Values& v) const { return roughness_of_alpha(v.alpha_u, v.alpha_v); }
  SurfaceKind kind(const Values&) const { return SurfaceKind::glossy; }

  RoughConductor bsdf;
};

}  // namespace warpath
