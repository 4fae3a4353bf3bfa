#pragma once
#include "tracer/fresnel.h"
#include "tracer/lobe.h"

namespace warpath {

template <>
struct Lobe<Conductor> : DeltaLobe {
  struct Values {
    Color reflectance;
  };
  Lobe(const Conductor& description, LobeContext&) : bsdf(description) {}
  LobeInputs inputs() const { return {{bsdf.specular_reflectance}, {}}; }
  LobeSample sample(const Values& v, const Vec3& wi, float, const Vec2&) const {
    if (!(wi.z > 0)) return {};
    return {.wo = reflect_local(wi), .weight = albedo(v, wi), .pdf = 1, .delta = true};
  }
  Color albedo(const Values& v, const Vec3& wi) const {
    return v.reflectance * fresnel_conductor(std::fabs(wi.z), bsdf.eta, bsdf.k);
  }

  Conductor bsdf;
};

}  // namespace warpath
