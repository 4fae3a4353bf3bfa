#include "tracer/fresnel.h"
#include "tracer/lobe.h"
#include "tracer/microfacet.h"

namespace warpath {

namespace {

/// Probability of the specular lobe when `transmitted` of the light enters the base.
float specular_probability(const LobeModel& m, float transmitted) {
  const float specular = (1 - transmitted) * m.specular_sampling_weight;
  const float diffuse = transmitted * (1 - m.specular_sampling_weight);
  return specular + diffuse > 0 ? specular / (specular + diffuse) : 1;
}

/// The base's reflectance after all bounces between it and the surface, with the change of solid angle on the way out.
Color base_reflectance(const LobeModel& m, const Color& diffuse) {
  const float inv_eta2 = 1 / (m.eta * m.eta);
  if (!m.nonlinear) return diffuse * (inv_eta2 / (1 - m.internal_reflectance));
  const Color& d = diffuse;
  const float r = m.internal_reflectance;
  return {d.x * inv_eta2 / (1 - d.x * r), d.y * inv_eta2 / (1 - d.y * r), d.z * inv_eta2 / (1 - d.z * r)};
}

}  // namespace

LobeEval eval_plastic(const LobeModel& m, const PlasticValues& v, const Vec3& wi, const Vec3& wo) {
  if (!(wi.z > 0 && wo.z > 0)) return {};
  const float f_i = fresnel_dielectric(wi.z, m.eta).reflectance, f_o = fresnel_dielectric(wo.z, m.eta).reflectance;
  const float cosine = cosine_hemisphere_pdf(wo.z);
  return {base_reflectance(m, v.diffuse) * (cosine * (1 - f_i) * (1 - f_o)),
          cosine * (1 - specular_probability(m, 1 - f_i))};
}

LobeSample sample_plastic(const LobeModel& m, const PlasticValues& v, const Vec3& wi, float u, const Vec2& dir) {
  LobeSample s;
  if (!(wi.z > 0)) return s;
  const float f_i = fresnel_dielectric(wi.z, m.eta).reflectance;
  const float specular = specular_probability(m, 1 - f_i);
  if (u < specular) {
    s.wo = reflect_local(wi);
    s.pdf = specular;
    s.delta = true;
    s.weight = v.specular * (f_i / specular);
  } else {
    s.wo = square_to_cosine_hemisphere(dir);
    s.pdf = (1 - specular) * cosine_hemisphere_pdf(s.wo.z);
    if (!(s.pdf > 0)) return s;
    const float f_o = fresnel_dielectric(s.wo.z, m.eta).reflectance;
    s.weight = base_reflectance(m, v.diffuse) * ((1 - f_i) * (1 - f_o) / (1 - specular));
  }
  return s;
}

LobeEval eval_rough_plastic(const LobeModel& m, const PlasticValues& v, const Vec3& wi, const Vec3& wo) {
  if (!(wi.z > 0 && wo.z > 0)) return {};
  const float t_i = m.transmittance(wi.z), t_o = m.transmittance(wo.z);
  const float specular = specular_probability(m, t_i);
  const float cosine = cosine_hemisphere_pdf(wo.z);
  LobeEval e{base_reflectance(m, v.diffuse) * (cosine * t_i * t_o), (1 - specular) * cosine};

  const Vec3 h = unit(wi + wo);
  const float cos_h = wi.dot(h);
  if (!(cos_h > 0)) return e;
  const Microfacet distribution(m.distribution, m.alpha, m.alpha, m.sample_visible);
  const float d = distribution.eval(h), g1_wi = distribution.smith_g1(wi, h);
  const float common = d * g1_wi / (4 * wi.z);
  const float f = fresnel_dielectric(cos_h, m.eta).reflectance;
  e.value += v.specular * (f * common * distribution.smith_g1(wo, h));
  e.pdf += specular * (m.sample_visible ? common : d * h.z / (4 * cos_h));
  return e;
}

LobeSample sample_rough_plastic(const LobeModel& m, const PlasticValues& v, const Vec3& wi, float u, const Vec2& dir) {
  LobeSample s;
  if (!(wi.z > 0)) return s;
  if (u < specular_probability(m, m.transmittance(wi.z))) {
    const Microfacet distribution(m.distribution, m.alpha, m.alpha, m.sample_visible);
    s.wo = reflect_about(wi, distribution.sample(wi, dir));
  } else {
    s.wo = square_to_cosine_hemisphere(dir);
  }
  const LobeEval e = eval_rough_plastic(m, v, wi, s.wo);
  s.pdf = e.pdf;
  if (e.pdf > 0) s.weight = e.value * (1 / e.pdf);
  return s;
}

}  // namespace warpath
