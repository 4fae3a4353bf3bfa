#pragma once
#include "tracer/fresnel.h"
#include "tracer/lobe.h"

namespace warpath {

/// What a dielectric surface reflects and transmits of the light from a direction.
inline Color dielectric_albedo(const Color& reflectance, const Color& transmittance, float cos_theta_i, float eta) {
  const float f = fresnel_dielectric(cos_theta_i, eta).reflectance;
  return reflectance * f + transmittance * (1 - f);
}

/// What dielectric and thindielectric have in common: all but sample().
template <class Bsdf>
struct SmoothDielectricLobe : DeltaLobe {
  struct Values {
    Color reflectance, transmittance;
  };
  SmoothDielectricLobe(const Bsdf& description, LobeContext&) : bsdf(description) {}
  LobeInputs inputs() const { return {{bsdf.specular_reflectance, bsdf.specular_transmittance}, {}}; }
  Color albedo(const Values& v, const Vec3& wi) const {
    return dielectric_albedo(v.reflectance, v.transmittance, wi.z, bsdf.eta);
  }

  Bsdf bsdf;
};

template <>
struct Lobe<Dielectric> : SmoothDielectricLobe<Dielectric> {
  using SmoothDielectricLobe::SmoothDielectricLobe;
  LobeSample sample(const Values& v, const Vec3& wi, float u, const Vec2& dir) const;
};

template <>
struct Lobe<ThinDielectric> : SmoothDielectricLobe<ThinDielectric> {
  using SmoothDielectricLobe::SmoothDielectricLobe;
  LobeSample sample(const Values& v, const Vec3& wi, float u, const Vec2& dir) const;
};

}  // namespace warpath
