#include "tracer/bsdf_plastic.h"

#include "tracer/fresnel.h"
#include "tracer/sample_square_to_hemisphere.h"

namespace warpath {

template <class Bsdf>
PlasticLobe<Bsdf>::PlasticLobe(const Bsdf& description, const TextureLookup& textures) : bsdf(description) {
  const float s = textures.mean(bsdf.specular_reflectance), sum = s + textures.mean(bsdf.diffuse_reflectance);
  specular_sampling_weight = sum > 0 ? s / sum : 0.5f;
}

template <class Bsdf>
Color PlasticLobe<Bsdf>::albedo_of(const Values& v, float transmitted) const {
  const float t = transmitted, r = internal_reflectance;
  const auto base = [&](float d) { return d * (1 - r) / (1 - (bsdf.nonlinear ? d * r : r)); };
  return v.specular * (1 - t) + Color(base(v.diffuse.x), base(v.diffuse.y), base(v.diffuse.z)) * t;
}

template struct PlasticLobe<Plastic>;
template struct PlasticLobe<RoughPlastic>;

Lobe<Plastic>::Lobe(const Plastic& description, LobeContext& context) : PlasticLobe(description, context.textures) {
  internal_reflectance = fresnel_diffuse_reflectance(1 / bsdf.eta);
}

LobeEval Lobe<Plastic>::eval(const Values& v, const Vec3& wi, const Vec3& wo) const {
  if (!(wi.z > 0 && wo.z > 0)) return {};
  const float f_i = fresnel_dielectric(wi.z, bsdf.eta).reflectance,
              f_o = fresnel_dielectric(wo.z, bsdf.eta).reflectance;
  const float cosine = cosine_hemisphere_pdf(wo.z);
  return {base_reflectance(v.diffuse) * (cosine * (1 - f_i) * (1 - f_o)), cosine * (1 - specular_probability(1 - f_i))};
}

LobeSample Lobe<Plastic>::sample(const Values& v, const Vec3& wi, float u, const Vec2& dir) const {
  LobeSample s;
  if (!(wi.z > 0)) return s;
  const float f_i = fresnel_dielectric(wi.z, bsdf.eta).reflectance;
  const float specular = specular_probability(1 - f_i);
  if (u < specular) {
    s.wo = reflect_local(wi);
    s.pdf = specular;
    s.delta = true;
    s.weight = v.specular * (f_i / specular);
  } else {
    s.wo = square_to_cosine_hemisphere(dir);
    s.pdf = (1 - specular) * cosine_hemisphere_pdf(s.wo.z);
    if (!(s.pdf > 0)) return s;
    const float f_o = fresnel_dielectric(s.wo.z, bsdf.eta).reflectance;
    s.weight = base_reflectance(v.diffuse) * ((1 - f_i) * (1 - f_o) / (1 - specular));
  }
  return s;
}

float Lobe<Plastic>::transmittance(float cosine) const { return 1 - fresnel_dielectric(cosine, bsdf.eta).reflectance; }

}  // namespace warpath
