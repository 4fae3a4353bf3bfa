#pragma once
#include "tracer/lobe.h"
#include "tracer/sample_square_to_hemisphere.h"

namespace warpath {

template <>
struct Lobe<Diffuse> {
  struct Values {
    Color reflectance;
  };
  Lobe(const Diffuse& description, LobeContext&) : bsdf(description) {}
  LobeInputs inputs() const { return {{bsdf.reflectance}, {}}; }
  LobeEval eval(const Values& v, const Vec3& wi, const Vec3& wo) const {
    if (!(wi.z > 0 && wo.z > 0)) return {};
    const float pdf = cosine_hemisphere_pdf(wo.z);
    return {v.reflectance * pdf, pdf};
  }
  LobeSample sample(const Values& v, const Vec3& wi, float, const Vec2& dir) const {
    LobeSample s;
    if (!(wi.z > 0)) return s;
    s.wo = square_to_cosine_hemisphere(dir);
    s.pdf = cosine_hemisphere_pdf(s.wo.z);
    if (s.pdf > 0) s.weight = v.reflectance;
    return s;
  }
  Color albedo(const Values& v, const Vec3&) const { return v.reflectance; }
  float roughness(const Values&) const { return 1; }
  SurfaceKind kind(const Values&) const { return SurfaceKind::diffuse; }

  Diffuse bsdf;
};

}  // namespace warpath
