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

/// Share of the light from wi that `eta` reflects (or refracts): the mean of G1(wo) F over the visible normals.
double scattered(const Microfacet& distribution, const Vec3& wi, float eta, bool refract, const Quadrature& q) {
  double sum = 0;
  for (std::size_t i = 0; i < q.nodes.size(); ++i) {
    for (std::size_t j = 0; j < q.nodes.size(); ++j) {
      const Vec2 u(static_cast<float>(q.nodes[i]), static_cast<float>(q.nodes[j]));
      const Vec3 m = distribution.sample(wi, u);
      const FresnelDielectric f = fresnel_dielectric(wi.dot(m), eta);
      const Vec3 wo = refract ? refract_about(wi, m, f) : reflect_about(wi, m);
      if ((wo.z > 0) == refract || wo.z == 0) continue;
      sum += q.weights[i] * q.weights[j] * distribution.smith_g1(wo, m) * (refract ? 1 - f.reflectance : f.reflectance);
    }
  }
  return sum;
}

}  // namespace

RoughInterface make_rough_interface(MicrofacetType type, float alpha, float eta) {
  constexpr int kNodes = RoughTransmittance::kNodes;
  const Microfacet distribution(type, alpha, alpha, true);
  // Below the critical angle's kink, which the outer sum over directions blurs, 32 x 32 nodes agree with Mitsuba's
  // 128 x 128 to 1e-3.
  const Quadrature quadrature = gauss_legendre(32);
  auto table = std::make_shared<RoughTransmittance::Table>();
  double internal = 0;
  for (int i = 0; i < kNodes; ++i) {
    const float mu = std::fmax(1e-6f, static_cast<float>(i) / (kNodes - 1));
    const Vec3 wi(std::sqrt(1 - mu * mu), 0, mu);
    (*table)[i] = static_cast<float>(scattered(distribution, wi, eta, true, quadrature));
    internal += scattered(distribution, wi, 1 / eta, false, quadrature) * mu;
  }
  // Mitsuba's rule: the mean over the nodes, ends included.
  return {RoughTransmittance(std::move(table)), static_cast<float>(2 * internal / kNodes)};
}

}  // namespace warpath
