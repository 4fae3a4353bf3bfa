#include "tracer/bsdf_rough_plastic.h"

#include "tracer/fresnel.h"

namespace warpath {

Lobe<RoughPlastic>::Lobe(const RoughPlastic& b, LobeContext& context) : PlasticLobe(b, context.textures) {
  bsdf.alpha = std::max(b.alpha, 1e-4f);
  const RoughInterface& surface = context.rough_interfaces.get(b.distribution, bsdf.alpha, b.eta);
  transmittance = surface.external_transmittance;
  internal_reflectance = surface.internal_reflectance;
}

LobeEval Lobe<RoughPlastic>::eval(const Values& v, const Vec3& wi, const Vec3& wo) const {
  if (!(wi.z > 0 && wo.z > 0)) return {};
  const float t_i = transmittance(wi.z), t_o = transmittance(wo.z);
  const float specular = specular_probability(t_i);
  const float cosine = cosine_hemisphere_pdf(wo.z);
  LobeEval e{base_reflectance(v.diffuse) * (cosine * t_i * t_o), (1 - specular) * cosine};

  const Vec3 h = unit(wi + wo);
  const float cos_h = wi.dot(h);
  if (!(cos_h > 0)) return e;
  const Microfacet distribution(bsdf.distribution, bsdf.alpha, bsdf.alpha, bsdf.sample_visible);
  const float d = distribution.eval(h), g1_wi = distribution.smith_g1(wi, h);
  const float common = d * g1_wi / (4 * wi.z);
  const float f = fresnel_dielectric(cos_h, bsdf.eta).reflectance;
  e.value += v.specular * (f * common * distribution.smith_g1(wo, h));
  e.pdf += specular * (bsdf.sample_visible ? common : d * h.z / (4 * cos_h));
  return e;
}

LobeSample Lobe<RoughPlastic>::sample(const Values& v, const Vec3& wi, float u, const Vec2& dir) const {
  LobeSample s;
  if (!(wi.z > 0)) return s;
  if (u < specular_probability(transmittance(wi.z))) {
    const Microfacet distribution(bsdf.distribution, bsdf.alpha, bsdf.alpha, bsdf.sample_visible);
    s.wo = reflect_about(wi, distribution.sample(wi, dir));
  } else {
    s.wo = square_to_cosine_hemisphere(dir);
  }
  const LobeEval e = eval(v, wi, s.wo);
  s.pdf = e.pdf;
  if (e.pdf > 0) s.weight = e.value * (1 / e.pdf);
  return s;
}

}  // namespace warpath
