#include "tracer/rough_transmittance.h"

#include <cmath>
#include <vector>

#include "tracer/fresnel.h"
#include "tracer/microfacet.h"

namespace warpath {

namespace {

struct Quadrature {
  std::vector<double> nodes, weights;  ///< on [0,1]
};

/// Gauss and Legendre's rule, by Newton's method on the Legendre polynomial of degree n.
Quadrature gauss_legendre(int n) {
  Quadrature q{std::vector<double>(n), std::vector<double>(n)};
  for (int i = 0; i < n; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), derivative = 1;
    for (int step = 0; step < 100; ++step) {
      double p = 1, before = 0;
      for (int k = 1; k <= n; ++k) {
        const double next = ((2 * k - 1) * x * p - (k - 1) * before) / k;
        before = p;
        p = next;
      }
      derivative = n * (x * p - before) / (x * x - 1);
      const double dx = p / derivative;
      x -= dx;
      if (std::fabs(dx) < 1e-15) break;
    }
    q.nodes[i] = 0.5 * (1 + x);
    q.weights[i] = 1 / ((1 - x * x) * derivative * derivative);
  }
  return q;
}

/// The visible normals of one direction, as slopes with weights, and what happens to light there.
class VisibleNormals {
 public:
  /// n x n nodes, of which symmetry leaves half: what lies across wi comes in pairs. n must be even.
  VisibleNormals(MicrofacetType type, float alpha, int n)
      : m_type(type), m_alpha(alpha), m_quadrature(gauss_legendre(n)) {
    const std::size_t half = n / 2;
    m_across.resize(n * half);
    m_towards.resize(n * half);
    m_weights.resize(n * half);
    m_slope_u.resize(n * half);
    m_slope_v.resize(n * half);
    m_terms.resize(n * half);
    for (std::size_t i = 0; i < m_quadrature.nodes.size(); ++i) {
      for (std::size_t j = 0; j < half; ++j) {
        const std::size_t k = i * half + j;
        const float x = static_cast<float>(m_quadrature.nodes[j]), y = static_cast<float>(m_quadrature.nodes[i]);
        m_weights[k] = 2 * m_quadrature.weights[i] * m_quadrature.weights[j];
        if (m_type == MicrofacetType::ggx) {
          const Vec2 p = square_to_disk({x, y});
          m_across[k] = p.x;
          m_towards[k] = p.y;
        } else {
          m_across[k] = erf_inverse(2 * x - 1);
        }
      }
    }
  }

  /// Share of the light from a direction with cosine mu that `eta` refracts (or else reflects): the mean of G1(wo)
  /// (1 - F) over the normals.
  double scattered(float mu, float eta, bool refract) {
    const float sine = std::sqrt(1 - mu * mu);
    const float length = std::sqrt(m_alpha * m_alpha * sine * sine + mu * mu);
    make_slopes(m_alpha * sine / length, mu / length);
    if (m_type == MicrofacetType::ggx)
      make_terms<MicrofacetType::ggx>(sine, mu, eta, refract);
    else
      make_terms<MicrofacetType::beckmann>(sine, mu, eta, refract);
    double sum = 0;
    for (std::size_t k = 0; k < m_terms.size(); ++k) sum += m_weights[k] * m_terms[k];
    return sum;
  }

 private:
  void make_slopes(float sin_theta, float cos_theta) {
    if (m_type == MicrofacetType::ggx) {
      for (std::size_t k = 0; k < m_terms.size(); ++k) {
        const Vec2 slope = visible_slope_ggx(sin_theta, cos_theta, {m_across[k], m_towards[k]});
        m_slope_u[k] = slope.x;
        m_slope_v[k] = slope.y;
      }
      return;
    }
    const std::size_t half = m_quadrature.nodes.size() / 2;
    for (std::size_t i = 0; i < m_quadrature.nodes.size(); ++i) {
      const float slope = visible_slope_beckmann(sin_theta, cos_theta, static_cast<float>(m_quadrature.nodes[i]));
      for (std::size_t j = 0; j < half; ++j) {
        m_slope_u[i * half + j] = slope;
        m_slope_v[i * half + j] = m_across[i * half + j];
      }
    }
  }

  // Without branches, so that the compiler makes SIMD code of it.
  template <MicrofacetType kType>
  void make_terms(float sine, float mu, float eta, bool refract) {
    const float alpha = m_alpha, eta_ti = 1 / eta;
    for (std::size_t k = 0; k < m_terms.size(); ++k) {
      const float u = m_slope_u[k] * alpha, v = m_slope_v[k] * alpha;
      const float m_z = 1 / std::sqrt(1 + u * u + v * v);
      const float cos_i = mu * m_z - sine * u * m_z;
      const float cos2_t = 1 - (1 - cos_i * cos_i) * eta_ti * eta_ti;
      const float cos_t = std::sqrt(cos2_t > 0 ? cos2_t : 0);
      const float a_s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
      const float a_p = (cos_t - eta * cos_i) / (cos_t + eta * cos_i);
      const float f = 0.5f * (a_s * a_s + a_p * a_p);
      const float reflected_z = 2 * cos_i * m_z - mu, refracted_z = mu * eta_ti - m_z * (cos_i * eta_ti - cos_t);
      const float z = refract ? refracted_z : reflected_z;  // away from the surface on its side
      const float z2 = z > 1e-10f ? z * z : 1e-20f;
      const float tan2 = alpha * alpha * (z2 < 1 ? 1 - z2 : 0) / z2;
      float g1;
      if constexpr (kType == MicrofacetType::ggx) {
        g1 = 2 / (1 + std::sqrt(1 + tan2));
      } else {
        const float a = 1 / std::sqrt(tan2 > 1e-20f ? tan2 : 1e-20f);
        const float fit = (3.535f * a + 2.181f * a * a) / (1 + 2.276f * a + 2.577f * a * a);
        g1 = a >= 1.6f ? 1 : fit;
      }
      const float share = refract ? 1 - f : f;
      m_terms[k] = z > 0 && cos_i > 0 ? g1 * share : 0;
    }
  }

  MicrofacetType m_type;
  float m_alpha;
  Quadrature m_quadrature;
  std::vector<float> m_across, m_towards, m_slope_u, m_slope_v, m_terms;
  std::vector<double> m_weights;
};

}  // namespace

RoughInterface make_rough_interface(MicrofacetType distribution, float alpha, float eta) {
  constexpr int kNodes = RoughTransmittance::kNodes;
  // As many nodes as Mitsuba has: total internal reflection makes a kink that even they do not quite resolve, and the
  // base's brightness goes with 1 / (1 - internal reflectance).
  const auto nodes = [](float from_eta) { return from_eta > 1 ? 32 : 128; };
  VisibleNormals outside(distribution, alpha, nodes(eta)), inside(distribution, alpha, nodes(1 / eta));
  auto table = std::make_shared<RoughTransmittance::Table>();
  double internal = 0;
  for (int i = 0; i < kNodes; ++i) {
    const float mu = larger(1e-6f, static_cast<float>(i) / (kNodes - 1));
    (*table)[i] = static_cast<float>(outside.scattered(mu, eta, true));
    internal += inside.scattered(mu, 1 / eta, false) * mu;
  }
  // Mitsuba's rule: the mean over the nodes, ends included.
  return {RoughTransmittance(std::move(table)), static_cast<float>(2 * internal / kNodes)};
}

const RoughInterface& RoughInterfaces::get(MicrofacetType distribution, float alpha, float eta) {
  const std::tuple key(distribution, alpha, eta);
  auto found = m_made.find(key);
  if (found == m_made.end()) found = m_made.emplace(key, make_rough_interface(distribution, alpha, eta)).first;
  return found->second;
}

}  // namespace warpath
