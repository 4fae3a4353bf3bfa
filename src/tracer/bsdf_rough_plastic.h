#pragma once
#include "tracer/bsdf_plastic.h"
#include "tracer/microfacet.h"

namespace warpath {

template <>
struct Lobe<RoughPlastic> : PlasticLobe<RoughPlastic> {
  Lobe(const RoughPlastic& bsdf, LobeContext& context);
  LobeEval eval(const Values& v, const Vec3& wi, const Vec3& wo) const;
  LobeSample sample(const Values& v, const Vec3& wi, float u, const Vec2& dir) const;
  Color albedo(const Values& v, const Vec3& wi) const { return albedo_of(v, transmittance(std::fabs(wi.z))); }
  float roughness(const Values&) const { return 0.5f + 0.5f * roughness_of_alpha(bsdf.alpha, bsdf.alpha); }

  RoughTransmittance transmittance;  ///< share of the light from a direction that passes the surface
};

}  // namespace warpath
