#include "tracer/bsdf_principled.h"

#include "tracer/fresnel.h"
#include "tracer/microfacet.h"
#include "tracer/sample_square_to_hemisphere.h"

namespace warpath {

// Mitsuba 3's `principled`. [Burley 2012, Physically Based Shading at Disney; Burley 2015, Extending the Disney BRDF]

namespace {

using Values = Lobe<Principled>::Values;

float mix(float a, float b, float t) { return a + (b - a) * t; }
Color mix(const Color& a, const Color& b, float t) { return a + (b - a) * t; }

/// (1 - cos)^5
float schlick_weight(float cosine) {
  const float m = clamp01(1 - cosine);
  return sqr(sqr(m)) * m;
}

/// Weight of white in Schlick's approximation; from within, by the angle outside.
float schlick_white(float cos_theta_i, float eta) {
  const bool outside = cos_theta_i >= 0;
  const float eta_it = outside ? eta : 1 / eta;
  if (eta_it > 1) return schlick_weight(std::fabs(cos_theta_i));
  return schlick_weight(std::sqrt(larger(0.0f, 1 - (1 - sqr(cos_theta_i)) / sqr(eta_it))));
}

/// Base colour without its luminance.
Color tint(const Color& base_color) {
  const float l = luminance(base_color);
  return l > 0 ? base_color * (1 / l) : Color(1.0f);
}

/// Clear coat's distribution of normals, GTR1; its shadowing is GGX's with roughness 0.25.
struct ClearCoat {
  float alpha2;
  explicit ClearCoat(float gloss) : alpha2(sqr(mix(0.1f, 0.001f, gloss))) {}
  float eval(const Vec3& h) const {
    const float d = (alpha2 - 1) / (kPi * std::log(alpha2) * (1 + (alpha2 - 1) * h.z * h.z));
    return d * h.z > 1e-20f ? d : 0;
  }
  float pdf(const Vec3& h) const { return h.z < 0 ? 0 : h.z * eval(h); }
  Vec3 sample(const Vec2& u) const {
    const float phi = 2 * kPi * u.x;
    const float cos2 = (1 - std::pow(alpha2, 1 - u.y)) / (1 - alpha2);
    const float sin_theta = std::sqrt(larger(0.0f, 1 - cos2));
    return {std::cos(phi) * sin_theta, std::sin(phi) * sin_theta, std::sqrt(larger(0.0f, cos2))};
  }
  static float smith_g1(const Vec3& v, const Vec3& h) {
    if (!(v.dot(h) * v.z > 0)) return 0;
    const float cos2 = v.z * v.z;
    const float tan2 = larger(0.0f, 1 - cos2) / cos2;
    return 2 / (1 + std::sqrt(1 + 0.0625f * tan2));
  }
};

/// What sampling and evaluation share at a point.
struct Setup {
  bool front;
  float base, transmitting;  ///< shares of the diffuse base and of the one that transmits
  Microfacet distribution;
  /// Probabilities of the lobes, but for the split of the main specular one by its Fresnel term.
  float diffuse = 0, clearcoat = 0, specular = 0;

  Setup(const Principled& m, const Values& v, const Vec3& wi)
      : front(wi.z > 0),
        base((1 - v.metallic) * (1 - v.spec_trans)),
        transmitting((1 - v.metallic) * v.spec_trans),
        distribution(make_distribution(m, v)) {
    if (front) {
      diffuse = base * m.diffuse_reflectance_sampling_rate;
      clearcoat = 0.25f * v.clearcoat * m.clearcoat_sampling_rate;
      specular = m.main_specular_sampling_rate;
    } else if (transmitting > 0) {
      specular = 1;  // within, only the main specular lobe scatters
    }
    const float total = diffuse + clearcoat + specular;
    const float scale = total > 0 ? 1 / total : 0;
    diffuse *= scale;
    clearcoat *= scale;
    specular *= scale;
  }
  /// Share of the main specular lobe that is refracted, at a microfacet with this Fresnel reflectance.
  float refracted(float fresnel) const { return (front ? transmitting : 1) * (1 - fresnel); }

  static Microfacet make_distribution(const Principled& m, const Values& v) {
    const float alpha = sqr(v.roughness);
    const float aspect = m.anisotropic >= 0 ? std::sqrt(1 - 0.9f * v.anisotropic) : 1;
    return {MicrofacetType::ggx, larger(0.001f, alpha / aspect), larger(0.001f, alpha * aspect), true};
  }
};

/// Fresnel term of the main specular reflection: dielectric, tinted dielectric, and metal.
Color specular_fresnel(const Principled& m, const Values& v, const Setup& setup, float fresnel, float cos_h) {
  if (!setup.front) return Color(setup.transmitting * fresnel);
  Color f((1 - v.metallic) * (1 - v.spec_tint) * fresnel);
  if (m.metallic < 0 && m.spec_tint < 0) return f;
  const float white = schlick_white(cos_h, m.eta);
  if (m.metallic >= 0) f += mix(v.base_color, Color(1.0f), white) * v.metallic;
  if (m.spec_tint >= 0) {
    const float eta_it = cos_h >= 0 ? m.eta : 1 / m.eta;
    const float r0 = sqr((eta_it - 1) / (eta_it + 1));
    f += mix(tint(v.base_color) * r0, Color(1.0f), white) * ((1 - v.metallic) * v.spec_tint);
  }
  return f;
}

/// The diffuse base with retro-reflection, flatness and sheen, times |cos theta_o|.
Color eval_base(const Principled& m, const Values& v, const Setup& setup, const Vec3& wi, const Vec3& wo, float cos_d) {
  const float f_i = schlick_weight(wi.z), f_o = schlick_weight(wo.z);
  const float rr = 2 * v.roughness * cos_d * cos_d;
  float f = (1 - 0.5f * f_i) * (1 - 0.5f * f_o) + rr * (f_o + f_i + f_o * f_i * (rr - 1));
  if (m.flatness >= 0) {
    const float fss = mix(1, 0.5f * rr, f_o) * mix(1, 0.5f * rr, f_i);
    f = mix(f, 1.25f * (fss * (1 / (wo.z + wi.z) - 0.5f) + 0.5f), v.flatness);
  }
  Color value = v.base_color * (setup.base * f * cosine_hemisphere_pdf(wo.z));
  // As in Mitsuba, there is sheen only where the diffuse base is.
  if (m.sheen >= 0 && setup.base > 0) {
    const Color color = m.sheen_tint >= 0 ? mix(Color(1.0f), tint(v.base_color), v.sheen_tint) : Color(1.0f);
    value += color * (v.sheen * (1 - v.metallic) * schlick_weight(std::fabs(cos_d)) * wo.z);
  }
  return value;
}

}  // namespace

LobeInputs Lobe<Principled>::inputs() const {
  const Principled& b = bsdf;
  return {{b.base_color},
          {b.roughness, b.anisotropic, b.metallic, b.spec_trans, b.spec_tint, b.sheen, b.sheen_tint, b.flatness,
           b.clearcoat, b.clearcoat >= 0 ? b.clearcoat_gloss : -1},
          b.anisotropic >= 0};
}

LobeEval Lobe<Principled>::eval(const Values& v, const Vec3& wi, const Vec3& wo) const {
  LobeEval e;
  if (wi.z == 0 || wo.z == 0) return e;
  const Setup setup(bsdf, v, wi);
  const bool reflect = wi.z * wo.z > 0;
  if (!setup.front && !(setup.transmitting > 0)) return e;
  const float eta = setup.front ? bsdf.eta : 1 / bsdf.eta;  // far side over the side of wi
  Vec3 h = wi + wo * (reflect ? 1.0f : eta);
  const float length2 = h.dot(h);
  if (!(length2 > 0)) return e;
  h *= (h.z < 0 ? -1.0f : 1.0f) / std::sqrt(length2);
  const float wi_h = wi.dot(h), wo_h = wo.dot(h);
  const bool facing = wi_h * wi.z > 0 && wo_h * wo.z > 0;  // facet and surface agree on the sides

  if (facing) {
    const float fresnel = fresnel_dielectric(wi_h, bsdf.eta).reflectance;
    const float g1_wi = setup.distribution.smith_g1(wi, h);
    const float visible = setup.distribution.eval(h) * g1_wi / std::fabs(wi.z);  // pdf of h over |wi.h|
    const float g1_wo = setup.distribution.smith_g1(wo, h);
    const float refracted = setup.refracted(fresnel);
    if (reflect) {
      // As in Mitsuba, an index of 1 reflects nothing, metal or not.
      if (fresnel > 0) e.value = specular_fresnel(bsdf, v, setup, fresnel, wi_h) * (visible * g1_wo * 0.25f);
      e.pdf = setup.specular * (1 - refracted) * visible * 0.25f;
      if (bsdf.clearcoat >= 0 && setup.front && v.clearcoat > 0) {
        const ClearCoat coat(v.clearcoat_gloss);
        const float f = mix(0.04f, 1, schlick_white(wi_h, bsdf.eta));
        const float g = ClearCoat::smith_g1(wi, h) * ClearCoat::smith_g1(wo, h);
        e.value += Color(v.clearcoat * 0.25f * f * coat.eval(h) * g * wo.z);
        e.pdf += setup.clearcoat * coat.pdf(h) / (4 * wo_h);
      }
    } else if (setup.transmitting > 0) {
      const float denominator = sqr(wi_h + eta * wo_h);
      if (denominator > 0) {
        const Color root(std::sqrt(larger(0.0f, v.base_color.x)), std::sqrt(larger(0.0f, v.base_color.y)),
                         std::sqrt(larger(0.0f, v.base_color.z)));
        const float jacobian = std::fabs(wo_h * wi_h) / denominator;
        e.value = root * (setup.transmitting * (1 - fresnel) * visible * g1_wo * jacobian);
        e.pdf = setup.specular * refracted * visible * jacobian * eta * eta;
      }
    }
  }
  if (reflect && setup.front) {
    if (setup.base > 0) e.value += eval_base(bsdf, v, setup, wi, wo, wo_h);
    e.pdf += setup.diffuse * cosine_hemisphere_pdf(wo.z);
  }
  return e;
}

LobeSample Lobe<Principled>::sample(const Values& v, const Vec3& wi, float u, const Vec2& dir) const {
  LobeSample s;
  if (wi.z == 0) return s;
  const Setup setup(bsdf, v, wi);
  if (!setup.front && !(setup.transmitting > 0)) return s;
  if (u < setup.diffuse) {
    s.wo = square_to_cosine_hemisphere(dir);
  } else if (u < setup.diffuse + setup.clearcoat) {
    s.wo = reflect_about(wi, ClearCoat(v.clearcoat_gloss).sample(dir));
    if (!(s.wo.z > 0)) return s;
  } else {
    const Vec3 h = setup.distribution.sample(setup.front ? wi : -wi, dir);
    const FresnelDielectric f = fresnel_dielectric(wi.dot(h), bsdf.eta);
    if (u < setup.diffuse + setup.clearcoat + setup.specular * setup.refracted(f.reflectance)) {
      s.wo = unit(refract_about(wi, h, f));
      if (!(s.wo.z * wi.z < 0)) return s;
      s.eta = f.eta_it;
    } else {
      s.wo = reflect_about(wi, h);
      if (!(s.wo.z * wi.z > 0)) return s;
    }
  }
  const LobeEval e = eval(v, wi, s.wo);
  s.pdf = e.pdf;
  if (e.pdf > 0) s.weight = e.value * (1 / e.pdf);
  return s;
}

}  // namespace warpath
