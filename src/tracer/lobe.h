#pragma once
#include <cstdint>
#include <cstring>

#include "scene/bsdf.h"
#include "tracer/rough_transmittance.h"
#include "tracer/sample_square_to_hemisphere.h"

namespace warpath {

// Lobes: the BSDFs that nest no other, as functions of local directions. Each has two halves: a LobeModel with what is
// the same everywhere, and values that are looked up from textures at a point. Meanings, lobe probabilities and the use
// of the random numbers are those of Mitsuba 3.9; where it samples a lobe in a way that is biased, we say so.

enum class LobeType : std::uint8_t {
  diffuse,
  conductor,
  rough_conductor,
  dielectric,
  thin_dielectric,
  rough_dielectric,
  plastic,
  rough_plastic,
  principled,
  null
};

/// Has it directions that light sampling can make?
inline bool is_smooth(LobeType type) {
  return type != LobeType::conductor && type != LobeType::dielectric && type != LobeType::thin_dielectric &&
         type != LobeType::null;
}

struct LobeModel {
  LobeType type = LobeType::null;
  MicrofacetType distribution = MicrofacetType::beckmann;
  bool sample_visible = true;
  bool nonlinear = false;
  float eta = 1;                       ///< inside over outside
  Color eta_conductor{0.0f}, k{1.0f};  ///< complex index of a conductor
  float specular_sampling_weight = 0;  ///< plastics: mean specular over mean specular and diffuse reflectance
  float internal_reflectance = 0;      ///< plastics: of diffuse light from within
  float alpha = 0;                     ///< roughplastic
  RoughTransmittance transmittance;    ///< roughplastic: share of the light from a direction that passes the surface
  /// principled
  bool has_anisotropic = false, has_metallic = false, has_spec_trans = false, has_spec_tint = false, has_sheen = false,
       has_sheen_tint = false, has_flatness = false, has_clearcoat = false;
  float diffuse_rate = 1, specular_rate = 1, clearcoat_rate = 1;
};

// What is looked up at a point, per type; arrays of float.
struct DiffuseValues {
  Color reflectance;
};
struct ConductorValues {
  Color reflectance;
};
struct RoughConductorValues {
  Color reflectance;
  float alpha_u, alpha_v;
};
struct DielectricValues {  // thin_dielectric too
  Color reflectance, transmittance;
};
struct RoughDielectricValues {
  Color reflectance, transmittance;
  float alpha_u, alpha_v;
};
struct PlasticValues {  // rough_plastic too
  Color diffuse, specular;
};
struct PrincipledValues {
  Color base_color;
  float roughness, anisotropic, metallic, spec_trans, spec_tint, sheen, sheen_tint, flatness, clearcoat,
      clearcoat_gloss;
};

template <class Values>
constexpr int kValueCount = sizeof(Values) / sizeof(float);

template <class Values>
Values load_values(const float* values) {
  Values result;
  std::memcpy(static_cast<void*>(&result), values, sizeof result);
  return result;
}

/// f |cos theta_o| of the non-delta part, and the density with which sampling makes wo.
struct LobeEval {
  Color value{0.0f};
  float pdf = 0;
};

struct LobeSample {
  Vec3 wo{0.0f, 0.0f, 1.0f};
  Color weight{0.0f};  ///< f |cos theta_o| / pdf; 0 if sampling failed
  float pdf = 0;       ///< of this lobe; a probability if delta
  float eta = 1;
  bool delta = false, null = false;
};

// `u` is Mitsuba's sample1, `dir` its sample2. Directions are unit; any wi and wo are allowed.

inline LobeEval eval_diffuse(const DiffuseValues& v, const Vec3& wi, const Vec3& wo) {
  if (!(wi.z > 0 && wo.z > 0)) return {};
  const float pdf = cosine_hemisphere_pdf(wo.z);
  return {v.reflectance * pdf, pdf};
}
inline LobeSample sample_diffuse(const DiffuseValues& v, const Vec3& wi, const Vec2& dir) {
  LobeSample s;
  if (!(wi.z > 0)) return s;
  s.wo = square_to_cosine_hemisphere(dir);
  s.pdf = cosine_hemisphere_pdf(s.wo.z);
  if (s.pdf > 0) s.weight = v.reflectance;
  return s;
}

LobeSample sample_conductor(const LobeModel& m, const ConductorValues& v, const Vec3& wi);
LobeEval eval_rough_conductor(const LobeModel& m, const RoughConductorValues& v, const Vec3& wi, const Vec3& wo);
LobeSample sample_rough_conductor(const LobeModel& m, const RoughConductorValues& v, const Vec3& wi, const Vec2& dir);

LobeSample sample_dielectric(const LobeModel& m, const DielectricValues& v, const Vec3& wi, float u);
LobeSample sample_thin_dielectric(const LobeModel& m, const DielectricValues& v, const Vec3& wi, float u);
LobeEval eval_rough_dielectric(const LobeModel& m, const RoughDielectricValues& v, const Vec3& wi, const Vec3& wo);
LobeSample sample_rough_dielectric(const LobeModel& m, const RoughDielectricValues& v, const Vec3& wi, float u,
                                   const Vec2& dir);

LobeEval eval_plastic(const LobeModel& m, const PlasticValues& v, const Vec3& wi, const Vec3& wo);
LobeSample sample_plastic(const LobeModel& m, const PlasticValues& v, const Vec3& wi, float u, const Vec2& dir);
LobeEval eval_rough_plastic(const LobeModel& m, const PlasticValues& v, const Vec3& wi, const Vec3& wo);
LobeSample sample_rough_plastic(const LobeModel& m, const PlasticValues& v, const Vec3& wi, float u, const Vec2& dir);

LobeEval eval_principled(const LobeModel& m, const PrincipledValues& v, const Vec3& wi, const Vec3& wo);
LobeSample sample_principled(const LobeModel& m, const PrincipledValues& v, const Vec3& wi, float u, const Vec2& dir);

/// By type; values as in Scatter::values.
LobeEval eval_lobe(const LobeModel& m, const float* values, const Vec3& wi, const Vec3& wo);
LobeSample sample_lobe(const LobeModel& m, const float* values, const Vec3& wi, float u, const Vec2& dir);
/// Approximate share of the light from wi that is scattered, and roughness: 0 delta, sqrt(alpha), 1 diffuse.
Color lobe_albedo(const LobeModel& m, const float* values, const Vec3& wi);
float lobe_roughness(const LobeModel& m, const float* values);

}  // namespace warpath
