#pragma once
#include <cmath>

#include "core/math.h"

namespace warpath {

struct FresnelDielectric {
  float reflectance;
  float cos_theta_t;  ///< of the refracted direction against the normal, of the other sign than cos_theta_i
  float eta_it;       ///< index on the far side over that on the side of wi
  float eta_ti;       ///< its reciprocal
};

/// Unpolarised Fresnel reflectance. cos_theta_i < 0 comes from within; eta is inside over outside.
inline FresnelDielectric fresnel_dielectric(float cos_theta_i, float eta) {
  FresnelDielectric f;
  const bool outside = cos_theta_i >= 0;
  const float inv_eta = 1 / eta;
  f.eta_it = outside ? eta : inv_eta;
  f.eta_ti = outside ? inv_eta : eta;
  const float cos_i = std::fabs(cos_theta_i);
  const float cos_t = std::sqrt(larger(0.0f, 1 - (1 - cos_i * cos_i) * f.eta_ti * f.eta_ti));
  if (eta == 1) {
    f.reflectance = 0;
  } else if (cos_i == 0) {
    f.reflectance = 1;
  } else {
    const float a_s = (cos_i - f.eta_it * cos_t) / (cos_i + f.eta_it * cos_t);
    const float a_p = (cos_t - f.eta_it * cos_i) / (cos_t + f.eta_it * cos_i);
    f.reflectance = 0.5f * (a_s * a_s + a_p * a_p);
  }
  f.cos_theta_t = outside ? -cos_t : cos_t;
  return f;
}

/// Unpolarised Fresnel reflectance of a conductor with complex index eta + i k, for cos_theta_i >= 0. [K. D. Moeller,
/// Optics, 1988]
inline Color fresnel_conductor(float cos_theta_i, const Color& eta, const Color& k) {
  const float cos2 = cos_theta_i * cos_theta_i, sin2 = 1 - cos2;
  // Four channels without branches, the last one spare: SIMD of one vector.
  const float eta4[4]{eta.x, eta.y, eta.z, eta.z}, k4[4]{k.x, k.y, k.z, k.z};
  float f[4];
  for (int c = 0; c < 4; ++c) {
    const float eta2 = eta4[c] * eta4[c], k2 = k4[c] * k4[c];
    const float d = eta2 - k2 - sin2;
    const float a2_b2 = std::sqrt(d * d + 4 * eta2 * k2);
    const float a2 = 0.5f * (a2_b2 + d);
    const float t2 = 2 * cos_theta_i * std::sqrt(a2 > 0 ? a2 : 0);
    const float t1 = a2_b2 + cos2, t3 = a2_b2 * cos2 + sin2 * sin2, t4 = t2 * sin2;
    // Nothing but zeros is left at grazing incidence on an index of 1: all light is reflected, of both polarisations.
    const float tiny = 1e-30f;
    const float r_s = (t1 - t2 + tiny) / (t1 + t2 + tiny);
    const float r_p = r_s * ((t3 - t4 + tiny) / (t3 + t4 + tiny));
    f[c] = 0.5f * (r_s + r_p);
  }
  return {f[0], f[1], f[2]};
}

/// Fresnel reflectance under diffuse light from the side on which eta is the far index. Relative error below 1 %.
/// [eta < 1: Egan and Hilgeman 1973; else d'Eon and Irving 2011, A Quantized-Diffusion Model, appendix]
inline float fresnel_diffuse_reflectance(float eta) {
  const float inv = 1 / eta;
  if (eta < 1) return -1.4399f * eta * eta + 0.7099f * eta + 0.6681f + 0.0636f * inv;
  return 0.919317f + inv * (-3.4793f + inv * (6.75335f + inv * (-7.80989f + inv * (4.98554f - 1.36881f * inv))));
}

inline Vec3 reflect_local(const Vec3& wi) { return {-wi.x, -wi.y, wi.z}; }
inline Vec3 reflect_about(const Vec3& wi, const Vec3& m) { return m * (2 * wi.dot(m)) - wi; }
inline Vec3 refract_local(const Vec3& wi, const FresnelDielectric& f) {
  return {-f.eta_ti * wi.x, -f.eta_ti * wi.y, f.cos_theta_t};
}
inline Vec3 refract_about(const Vec3& wi, const Vec3& m, const FresnelDielectric& f) {
  return m * (wi.dot(m) * f.eta_ti + f.cos_theta_t) - wi * f.eta_ti;
}

}  // namespace warpath
