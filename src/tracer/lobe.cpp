#include "tracer/lobe.h"

#include <algorithm>

#include "tracer/fresnel.h"

namespace warpath {

LobeEval eval_lobe(const LobeModel& m, const float* values, const Vec3& wi, const Vec3& wo) {
  switch (m.type) {
    case LobeType::diffuse:
      return eval_diffuse(load_values<DiffuseValues>(values), wi, wo);
    case LobeType::rough_conductor:
      return eval_rough_conductor(m, load_values<RoughConductorValues>(values), wi, wo);
    case LobeType::rough_dielectric:
      return eval_rough_dielectric(m, load_values<RoughDielectricValues>(values), wi, wo);
    case LobeType::plastic:
      return eval_plastic(m, load_values<PlasticValues>(values), wi, wo);
    case LobeType::rough_plastic:
      return eval_rough_plastic(m, load_values<PlasticValues>(values), wi, wo);
    case LobeType::principled:
      return eval_principled(m, load_values<PrincipledValues>(values), wi, wo);
    case LobeType::conductor:
    case LobeType::dielectric:
    case LobeType::thin_dielectric:
    case LobeType::null:
      break;
  }
  return {};
}

LobeSample sample_lobe(const LobeModel& m, const float* values, const Vec3& wi, float u, const Vec2& dir) {
  switch (m.type) {
    case LobeType::diffuse:
      return sample_diffuse(load_values<DiffuseValues>(values), wi, dir);
    case LobeType::conductor:
      return sample_conductor(m, load_values<ConductorValues>(values), wi);
    case LobeType::rough_conductor:
      return sample_rough_conductor(m, load_values<RoughConductorValues>(values), wi, dir);
    case LobeType::dielectric:
      return sample_dielectric(m, load_values<DielectricValues>(values), wi, u);
    case LobeType::thin_dielectric:
      return sample_thin_dielectric(m, load_values<DielectricValues>(values), wi, u);
    case LobeType::rough_dielectric:
      return sample_rough_dielectric(m, load_values<RoughDielectricValues>(values), wi, u, dir);
    case LobeType::plastic:
      return sample_plastic(m, load_values<PlasticValues>(values), wi, u, dir);
    case LobeType::rough_plastic:
      return sample_rough_plastic(m, load_values<PlasticValues>(values), wi, u, dir);
    case LobeType::principled:
      return sample_principled(m, load_values<PrincipledValues>(values), wi, u, dir);
    case LobeType::null:
      break;
  }
  LobeSample through;
  through.wo = -wi;
  through.weight = Color(1.0f);
  through.pdf = 1;
  through.delta = through.null = true;
  return through;
}

Color lobe_albedo(const LobeModel& m, const float* values, const Vec3& wi) {
  const float cosine = std::fabs(wi.z);
  switch (m.type) {
    case LobeType::diffuse:
      return load_values<DiffuseValues>(values).reflectance;
    case LobeType::conductor:
    case LobeType::rough_conductor:
      return load_values<ConductorValues>(values).reflectance * fresnel_conductor(cosine, m.eta_conductor, m.k);
    case LobeType::dielectric:
    case LobeType::thin_dielectric:
    case LobeType::rough_dielectric: {
      const auto v = load_values<DielectricValues>(values);
      const float f = fresnel_dielectric(wi.z, m.eta).reflectance;
      return v.reflectance * f + v.transmittance * (1 - f);
    }
    case LobeType::plastic:
    case LobeType::rough_plastic: {
      const auto v = load_values<PlasticValues>(values);
      const float t =
          m.type == LobeType::plastic ? 1 - fresnel_dielectric(cosine, m.eta).reflectance : m.transmittance(cosine);
      const float r = m.internal_reflectance;
      const auto base = [&](float d) { return d * (1 - r) / (1 - (m.nonlinear ? d * r : r)); };
      return v.specular * (1 - t) + Color(base(v.diffuse.x), base(v.diffuse.y), base(v.diffuse.z)) * t;
    }
    case LobeType::principled:
      return load_values<PrincipledValues>(values).base_color;
    case LobeType::null:
      break;
  }
  return Color(1.0f);
}

float lobe_roughness(const LobeModel& m, const float* values) {
  const auto of_alpha = [](float u, float v) { return clamp01(std::sqrt(std::sqrt(larger(0.0f, u * v)))); };
  // Plastics: base and surface share the light about evenly in what a path sees of them.
  switch (m.type) {
    case LobeType::diffuse:
      return 1;
    case LobeType::rough_conductor: {
      const auto v = load_values<RoughConductorValues>(values);
      return of_alpha(v.alpha_u, v.alpha_v);
    }
    case LobeType::rough_dielectric: {
      const auto v = load_values<RoughDielectricValues>(values);
      return of_alpha(v.alpha_u, v.alpha_v);
    }
    case LobeType::plastic:
      return 0.5f;
    case LobeType::rough_plastic:
      return 0.5f + 0.5f * of_alpha(m.alpha, m.alpha);
    case LobeType::principled: {
      const auto v = load_values<PrincipledValues>(values);
      const float diffuse = 0.5f * (1 - v.metallic) * (1 - v.spec_trans);
      return diffuse + (1 - diffuse) * clamp01(v.roughness);
    }
    case LobeType::conductor:
    case LobeType::dielectric:
    case LobeType::thin_dielectric:
    case LobeType::null:
      break;
  }
  return 0;
}

}  // namespace warpath
