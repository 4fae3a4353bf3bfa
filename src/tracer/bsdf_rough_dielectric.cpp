#include "tracer/bsdf_rough_dielectric.h"

namespace warpath {

namespace {

/// Walter et al. 2007 widen the distribution that normals are drawn from, for bounded weights, where those normals are
/// not chosen among the visible ones.
Microfacet sampling_distribution(const Microfacet& distribution, float cos_theta_i) {
  Microfacet wide = distribution;
  if (!distribution.sample_visible()) wide.scale_alpha(1.2f - 0.2f * std::sqrt(std::fabs(cos_theta_i)));
  return wide;
}

Vec3 upwards(const Vec3& v) { return v.z < 0 ? -v : v; }

}  // namespace

LobeEval Lobe<RoughDielectric>::eval(const Values& v, const Vec3& wi, const Vec3& wo) const {
  if (wi.z == 0) return {};
  const bool reflect = wi.z * wo.z > 0;
  const float eta = wi.z > 0 ? bsdf.eta : 1 / bsdf.eta;  // far side over the side of wi
  Vec3 h = wi + wo * (reflect ? 1.0f : eta);
  const float length2 = h.dot(h);
  if (!(length2 > 0)) return {};
  h = upwards(h * (1 / std::sqrt(length2)));
  const float wi_h = wi.dot(h), wo_h = wo.dot(h);
  if (!(wi_h * wi.z > 0 && wo_h * wo.z > 0)) return {};

  const Microfacet distribution(bsdf.distribution, v.alpha_u, v.alpha_v, bsdf.sample_visible);
  const float f = fresnel_dielectric(wi_h, bsdf.eta).reflectance;
  const float dg = distribution.eval(h) * distribution.smith_g1(wi, h) * distribution.smith_g1(wo, h);
  const float pdf_h = sampling_distribution(distribution, wi.z).pdf(upwards(wi), h);
  if (reflect) return {v.reflectance * (f * dg / (4 * std::fabs(wi.z))), pdf_h * f / (4 * std::fabs(wo_h))};
  const float denominator = sqr(wi_h + eta * wo_h);
  if (!(denominator > 0)) return {};
  // dwh / dwo is eta^2 |wo.h| / denominator; the value's eta^2 falls to the compression of radiance, 1 / eta^2.
  return {v.transmittance * ((1 - f) * dg * std::fabs(wi_h * wo_h / (wi.z * denominator))),
          pdf_h * (1 - f) * eta * eta * std::fabs(wo_h) / denominator};
}

LobeSample Lobe<RoughDielectric>::sample(const Values& v, const Vec3& wi, float u, const Vec2& dir) const {
  LobeSample s;
  if (wi.z == 0) return s;
  const Microfacet distribution(bsdf.distribution, v.alpha_u, v.alpha_v, bsdf.sample_visible);
  const Microfacet sampled = sampling_distribution(distribution, wi.z);
  const Vec3 h = sampled.sample(upwards(wi), dir);
  const float pdf_h = sampled.pdf(upwards(wi), h);
  if (!(pdf_h > 0)) return s;
  const float wi_h = wi.dot(h);
  const FresnelDielectric f = fresnel_dielectric(wi_h, bsdf.eta);
  const bool reflect = u < f.reflectance;
  const Vec3 wo = unit(reflect ? reflect_about(wi, h) : refract_about(wi, h, f));
  const float wo_h = wo.dot(h);
  if (!(wi_h * wi.z > 0 && wo_h * wo.z > 0) || (wo.z * wi.z > 0) != reflect) return s;

  s.wo = wo;
  // D and G1(wi) cancel where visible normals are drawn. (For sample_visible = false Mitsuba 3.9 takes D to cancel too,
  // although it draws from the wider distribution.)
  float weight = distribution.smith_g1(wo, h);
  if (!bsdf.sample_visible)
    weight *= distribution.eval(h) * distribution.smith_g1(wi, h) * std::fabs(wi_h / wi.z) / pdf_h;
  if (reflect) {
    s.pdf = pdf_h * f.reflectance / (4 * std::fabs(wo_h));
    s.weight = v.reflectance * weight;
  } else {
    const float denominator = sqr(wi_h + f.eta_it * wo_h);
    if (!(denominator > 0)) return {};
    s.pdf = pdf_h * (1 - f.reflectance) * sqr(f.eta_it) * std::fabs(wo_h) / denominator;
    s.eta = f.eta_it;
    s.weight = v.transmittance * (weight * sqr(f.eta_ti));
  }
  return s;
}

}  // namespace warpath
