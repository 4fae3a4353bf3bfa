#pragma once
#include <algorithm>
#include <cmath>

#include "scene/bsdf.h"
#include "tracer/sample_square_to_hemisphere.h"

namespace warpath {

/// Inverse of std::erf for |x| < 1, relative error below 1e-6. [Giles 2010, Approximating the erfinv function]
inline float erf_inverse(float x) {
  float w = -std::log((1 - x) * (1 + x)), p;
  if (w < 5) {
    w -= 2.5f;
    p = 2.81022636e-08f;
    for (const float c : {3.43273939e-07f, -3.5233877e-06f, -4.39150654e-06f, 0.00021858087f, -0.00125372503f,
                          -0.00417768164f, 0.246640727f, 1.50140941f})
      p = p * w + c;
  } else {
    w = std::sqrt(w) - 3;
    p = -0.000200214257f;
    for (const float c : {0.000100950558f, 0.00134934322f, -0.00367342844f, 0.00573950773f, -0.0076224613f,
                          0.00943887047f, 1.00167406f, 2.83297682f})
      p = p * w + c;
  }
  return p * x;
}

/// Slope towards wi of a normal that is visible from angle theta, with u in (0,1), for Beckmann's distribution of
/// roughness 1. Newton's method on the distribution function, in the domain of erf: continuous in u, unlike the
/// published inversion. The slope across is erf_inverse(2 u' - 1), whatever theta.
inline float visible_slope_beckmann(float sin_theta, float cos_theta, float u) {
  const float inv_sqrt_pi = 0.5641895835f, limit = 1 - 1e-6f;
  const float tan_theta = sin_theta / larger(cos_theta, 1e-6f);
  const float cot_theta = tan_theta > 0 ? 1 / tan_theta : 1e10f;
  const float max = std::erf(cot_theta);
  float x = max - (max + 1) * std::erf(std::sqrt(-std::log(u)));  // the solution at grazing incidence
  const float target = u * (1 + max + inv_sqrt_pi * tan_theta * std::exp(-cot_theta * cot_theta));
  for (int i = 0; i < 3; ++i) {
    x = std::clamp(x, -limit, limit);
    const float slope = erf_inverse(x);
    const float value = 1 + x + inv_sqrt_pi * tan_theta * std::exp(-slope * slope) - target;
    const float derivative = 1 - slope * tan_theta;
    if (!(derivative > 1e-10f)) break;
    x -= value / derivative;
  }
  return erf_inverse(std::clamp(x, -limit, limit));
}

/// Slopes towards and across wi of a visible normal, for GGX of roughness 1; p is uniform in the unit disk: the half
/// disk that wi sees from the side is squeezed by cos(theta). [Heitz 2018, Sampling the GGX Distribution of Visible
/// Normals]
inline Vec2 visible_slope_ggx(float sin_theta, float cos_theta, const Vec2& p) {
  const float s = 0.5f * (1 + cos_theta), x2 = p.x * p.x;
  const float y = std::sqrt(x2 < 1 ? 1 - x2 : 0) * (1 - s) + p.y * s;
  const float z2 = 1 - x2 - y * y;
  const float z = std::sqrt(z2 > 0 ? z2 : 0);
  // A floor keeps slopes finite at the rim under grazing incidence.
  const float cosine = sin_theta * y + cos_theta * z;
  const float norm = 1 / (cosine > 1e-10f ? cosine : 1e-10f);
  return {(cos_theta * y - sin_theta * z) * norm, p.x * norm};
}

/// Distribution of microfacet normals m around +z, with Smith's shadowing. Directions are local and unit.
/// [Walter et al. 2007, Microfacet Models for Refraction; Heitz and d'Eon 2014, Importance Sampling Microfacet-Based
/// BSDFs using the Distribution of Visible Normals; Heitz 2018 for GGX]
class Microfacet {
 public:
  Microfacet(MicrofacetType type, float alpha_u, float alpha_v, bool sample_visible)
      : m_type(type),
        m_sample_visible(sample_visible),
        m_alpha_u(larger(alpha_u, 1e-4f)),
        m_alpha_v(larger(alpha_v, 1e-4f)) {}

  bool sample_visible() const { return m_sample_visible; }
  void scale_alpha(float factor) {
    m_alpha_u *= factor;
    m_alpha_v *= factor;
  }

  /// Density D(m): its integral times cos(theta_m) is 1.
  float eval(const Vec3& m) const {
    float d;
    if (m_type == MicrofacetType::ggx) {
      // 1 / (pi au av ((x / au)^2 + (y / av)^2 + z^2)^2), with one division.
      const float area = m_alpha_u * m_alpha_v;
      const float sum = sqr(m.x * m_alpha_v) + sqr(m.y * m_alpha_u) + sqr(m.z * area);
      d = area * area * area / (kPi * sum * sum);
    } else {
      const float cos2 = m.z * m.z;
      d = std::exp(-(sqr(m.x / m_alpha_u) + sqr(m.y / m_alpha_v)) / cos2) / (kPi * m_alpha_u * m_alpha_v * cos2 * cos2);
    }
    return d * m.z > 1e-20f ? d : 0;
  }

  /// Share of the microfacets with normal m that v sees; 0 if it sees them from the other side than the surface.
  float smith_g1(const Vec3& v, const Vec3& m) const { return v.dot(m) * v.z > 0 ? smith_g1(v) : 0; }

  /// Density of the normals that sample() makes, per solid angle of m. wi.z > 0.
  float pdf(const Vec3& wi, const Vec3& m) const {
    if (!m_sample_visible) return eval(m) * m.z;
    return wi.z > 0 ? eval(m) * smith_g1(wi, m) * std::fabs(wi.dot(m)) / wi.z : 0;
  }

  /// Draws a normal, of those that wi sees if sample_visible. wi.z > 0.
  Vec3 sample(const Vec3& wi, const Vec2& u) const { return m_sample_visible ? visible(wi, u) : any(u); }

 private:
  float smith_g1(const Vec3& v) const {
    const float xy2 = sqr(m_alpha_u * v.x) + sqr(m_alpha_v * v.y);
    if (xy2 == 0) return 1;
    const float tan2 = xy2 / (v.z * v.z);
    if (m_type == MicrofacetType::ggx) return 2 / (1 + std::sqrt(1 + tan2));
    // Rational fit of Walter et al., error below 0.35 %.
    const float a = 1 / std::sqrt(tan2);
    return a >= 1.6f ? 1 : (3.535f * a + 2.181f * a * a) / (1 + 2.276f * a + 2.577f * a * a);
  }

  Vec3 any(const Vec2& u) const {
    float sin_phi, cos_phi, alpha2 = m_alpha_u * m_alpha_u;
    if (m_alpha_u == m_alpha_v) {
      sin_phi = std::sin(2 * kPi * u.y);
      cos_phi = std::cos(2 * kPi * u.y);
    } else {
      const float tan_phi = m_alpha_v / m_alpha_u * std::tan(2 * kPi * u.y);
      cos_phi = std::copysign(1 / std::sqrt(1 + tan_phi * tan_phi), std::fabs(u.y - 0.5f) - 0.25f);
      sin_phi = cos_phi * tan_phi;
      alpha2 = 1 / (sqr(cos_phi / m_alpha_u) + sqr(sin_phi / m_alpha_v));
    }
    const float tan2 = alpha2 * (m_type == MicrofacetType::beckmann ? -std::log(1 - u.x) : u.x / (1 - u.x));
    const float cos_theta = 1 / std::sqrt(1 + tan2);
    const float sin_theta = std::sqrt(tan2) * cos_theta;
    return {cos_phi * sin_theta, sin_phi * sin_theta, cos_theta};
  }

  Vec3 visible(const Vec3& wi, const Vec2& u) const {
    // Stretched so that the roughness is 1, sampled there as if wi had no azimuth, turned and squeezed back.
    const float x = m_alpha_u * wi.x, y = m_alpha_v * wi.y;
    const float xy2 = x * x + y * y;
    const float inv_xy = 1 / std::sqrt(larger(xy2, 1e-38f)), inv_all = 1 / std::sqrt(xy2 + wi.z * wi.z);
    const float cos_phi = xy2 > 1e-38f ? x * inv_xy : 1, sin_phi = xy2 > 1e-38f ? y * inv_xy : 0;
    const float sin_theta = xy2 * inv_xy * inv_all, cos_theta = wi.z * inv_all;
    Vec2 slope;
    if (m_type == MicrofacetType::ggx) {
      slope = visible_slope_ggx(sin_theta, cos_theta, square_to_disk(u));
    } else {
      // Away from 0 and 1, where slopes are infinite.
      const Vec2 inner(std::clamp(u.x, 1e-6f, 1 - 1e-6f), std::clamp(u.y, 1e-6f, 1 - 1e-6f));
      slope = {visible_slope_beckmann(sin_theta, cos_theta, inner.x), erf_inverse(2 * inner.y - 1)};
    }
    const float slope_u = (cos_phi * slope.x - sin_phi * slope.y) * m_alpha_u;
    const float slope_v = (sin_phi * slope.x + cos_phi * slope.y) * m_alpha_v;
    const float inv_length = 1 / std::sqrt(1 + slope_u * slope_u + slope_v * slope_v);
    return {-slope_u * inv_length, -slope_v * inv_length, inv_length};
  }

  MicrofacetType m_type;
  bool m_sample_visible;
  float m_alpha_u, m_alpha_v;
};

/// Of a lobe, 0 to 1: the square root of alpha, which the eye finds even.
inline float roughness_of_alpha(float alpha_u, float alpha_v) {
  return clamp01(std::sqrt(std::sqrt(larger(0.0f, alpha_u * alpha_v))));
}

}  // namespace warpath
