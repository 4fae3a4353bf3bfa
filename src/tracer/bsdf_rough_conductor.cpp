#include "tracer/bsdf_rough_conductor.h"

namespace warpath {

LobeEval Lobe<RoughConductor>::eval(const Values& v, const Vec3& wi, const Vec3& wo) const {
  if (!(wi.z > 0 && wo.z > 0)) return {};
  const Vec3 h = unit(wi + wo);
  const float cos_h = wi.dot(h);
  if (!(cos_h > 0)) return {};
  const Microfacet distribution(bsdf.distribution, v.alpha_u, v.alpha_v, bsdf.sample_visible);
  const float d = distribution.eval(h);
  if (d == 0) return {};
  const float g1_wi = distribution.smith_g1(wi, h);
  const float common = d * g1_wi / (4 * wi.z);
  const Color f = fresnel_conductor(cos_h, bsdf.eta, bsdf.k);
  return {v.reflectance * f * (common * distribution.smith_g1(wo, h)),
          bsdf.sample_visible ? common : d * h.z / (4 * cos_h)};
}

LobeSample Lobe<RoughConductor>::sample(const Values& v, const Vec3& wi, float, const Vec2& dir) const {
  LobeSample s;
  if (!(wi.z > 0)) return s;
  const Microfacet distribution(bsdf.distribution, v.alpha_u, v.alpha_v, bsdf.sample_visible);
  const Vec3 h = distribution.sample(wi, dir);
  const float cos_h = wi.dot(h);
  const Vec3 wo = reflect_about(wi, h);
  if (!(cos_h > 0 && wo.z > 0)) return s;
  s.wo = wo;
  s.pdf = distribution.pdf(wi, h) / (4 * cos_h);
  if (!(s.pdf > 0)) return s;
  const float g1_wo = distribution.smith_g1(wo, h);
  const float weight = bsdf.sample_visible ? g1_wo : distribution.smith_g1(wi, h) * g1_wo * cos_h / (wi.z * h.z);
  s.weight = v.reflectance * fresnel_conductor(cos_h, bsdf.eta, bsdf.k) * weight;
  return s;
}

}  // namespace warpath
