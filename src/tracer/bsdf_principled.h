#pragma once
#include "tracer/lobe.h"

namespace warpath {

template <>
struct Lobe<Principled> {
  struct Values {
    Color base_color;
    float roughness, anisotropic, metallic, spec_trans, spec_tint, sheen, sheen_tint, flatness, clearcoat,
        clearcoat_gloss;
  };
  Lobe(const Principled& description, LobeContext&) : bsdf(description) {}
  LobeInputs inputs() const;
  LobeEval eval(const Values& v, const Vec3& wi, const Vec3& wo) const;
  LobeSample sample(const Values& v, const Vec3& wi, float u, const Vec2& dir) const;
  Color albedo(const Values& v, const Vec3&) const { return v.base_color; }
  float roughness(const Values& v) const {
    const float diffuse = 0.5f * (1 - v.metallic) * (1 - v.spec_trans);
    return diffuse + (1 - diffuse) * clamp01(v.roughness);
  }
  SurfaceKind kind(const Values& v) const {
    return (1 - v.metallic) * (1 - v.spec_trans) > 0 ? SurfaceKind::mixed : SurfaceKind::glossy;
  }

  Principled bsdf;
};

}  // namespace warpath
