#include "tracer/fresnel.h"
#include "tracer/lobe.h"
#include "tracer/microfacet.h"

namespace warpath {

LobeSample sample_conductor(const LobeModel& m, const ConductorValues& v, const Vec3& wi) {
  LobeSample s;
  if (!(wi.z > 0)) return s;
  s.wo = reflect_local(wi);
  s.weight = v.reflectance * fresnel_conductor(wi.z, m.eta_conductor, m.k);
  s.pdf = 1;
  s.delta = true;
  return s;
}

LobeEval eval_rough_conductor(const LobeModel& m, const RoughConductorValues& v, const Vec3& wi, const Vec3& wo) {
  if (!(wi.z > 0 && wo.z > 0)) return {};
  const Vec3 h = unit(wi + wo);
  const float cos_h = wi.dot(h);
  if (!(cos_h > 0)) return {};
  const Microfacet distribution(m.distribution, v.alpha_u, v.alpha_v, m.sample_visible);
  const float d = distribution.eval(h);
  if (d == 0) return {};
  const float g1_wi = distribution.smith_g1(wi, h);
  const float common = d * g1_wi / (4 * wi.z);
  const Color f = fresnel_conductor(cos_h, m.eta_conductor, m.k);
  return {v.reflectance * f * (common * distribution.smith_g1(wo, h)),
          m.sample_visible ? common : d * h.z / (4 * cos_h)};
}

LobeSample sample_rough_conductor(const LobeModel& m, const RoughConductorValues& v, const Vec3& wi, const Vec2& dir) {
  LobeSample s;
  if (!(wi.z > 0)) return s;
  const Microfacet distribution(m.distribution, v.alpha_u, v.alpha_v, m.sample_visible);
  const Vec3 h = distribution.sample(wi, dir);
  const float cos_h = wi.dot(h);
  const Vec3 wo = reflect_about(wi, h);
  if (!(cos_h > 0 && wo.z > 0)) return s;
  s.wo = wo;
  s.pdf = distribution.pdf(wi, h) / (4 * cos_h);
  if (!(s.pdf > 0)) return s;
  const float g1_wo = distribution.smith_g1(wo, h);
  const float weight = m.sample_visible ? g1_wo : distribution.smith_g1(wi, h) * g1_wo * cos_h / (wi.z * h.z);
  s.weight = v.reflectance * fresnel_conductor(cos_h, m.eta_conductor, m.k) * weight;
  return s;
}

}  // namespace warpath
