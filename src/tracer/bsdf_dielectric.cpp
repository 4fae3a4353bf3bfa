#include "tracer/bsdf_dielectric.h"

namespace warpath {

LobeSample Lobe<Dielectric>::sample(const Values& v, const Vec3& wi, float u, const Vec2&) const {
  const FresnelDielectric f = fresnel_dielectric(wi.z, bsdf.eta);
  LobeSample s;
  s.delta = true;
  if (u < f.reflectance) {
    s.wo = reflect_local(wi);
    s.pdf = f.reflectance;
    s.weight = v.reflectance;
  } else {
    s.wo = refract_local(wi, f);
    s.pdf = 1 - f.reflectance;
    s.eta = f.eta_it;
    // Radiance is compressed in solid angle where it enters the denser medium.
    s.weight = v.transmittance * (f.eta_ti * f.eta_ti);
  }
  return s;
}

namespace {

/// Reflectance of a thin sheet: all bounces between its two faces. r + t r t + t r^3 t + ...
float sheet_reflectance(float cos_theta, float eta) {
  const float r = fresnel_dielectric(std::fabs(cos_theta), eta).reflectance;
  return 2 * r / (1 + r);
}

}  // namespace

LobeSample Lobe<ThinDielectric>::sample(const Values& v, const Vec3& wi, float u, const Vec2&) const {
  const float r = sheet_reflectance(wi.z, bsdf.eta);
  LobeSample s;
  s.delta = true;
  if (u < r) {
    s.wo = reflect_local(wi);
    s.pdf = r;
    s.weight = v.reflectance;
  } else {
    s.wo = -wi;
    s.pdf = 1 - r;
    s.weight = v.transmittance;
    s.null = true;
  }
  return s;
}

}  // namespace warpath
