#pragma once
#include <cmath>
#include <vector>

#include "warp/net_reference.h"
#include "warp/realnvp_flow.h"
#include "warp/realnvp_kernels.h"

namespace warpath::realnvp {

/// ln q(y) in plain loops and doubles, one sample at a time: what the kernels are tested against. [DSB17], [ZZ19]
class Reference {
 public:
  Reference(const Flow& flow, std::vector<double> parameters) : m_flow(flow), p(std::move(parameters)) {}
  std::vector<double>& parameters() { return p; }

  double log_density(const std::vector<double>& y) const {
    std::vector<double> v;
    double log_q = 0;
    for (const double x : y) v.push_back(std::log(x / (1 - x)));
    for (const double x : v) log_q -= log_logistic(x);
    for (std::size_t c = m_flow.couplings().size(); c-- > 0;) {
      const Coupling& coupling = m_flow.couplings()[c];
      std::vector<double> inputs, heads;
      for (const int k : coupling.kept) {
        const double edge = static_cast<double>(kEdge), x = std::clamp(v[static_cast<std::size_t>(k)], -edge, edge);
        inputs.push_back(x);
        for (int bin = 0; bin < m_flow.settings().encoding_bins; ++bin) {
          const double t =
              (m_flow.settings().encoding_bins / (1 + std::exp(-x)) - bin - 0.5) / static_cast<double>(kBlobRadius);
          inputs.push_back(std::abs(t) < 1 ? (1 - t * t) * (1 - t * t) : 0);
        }
      }
      for (std::size_t n = 0; n < coupling.nets.size(); ++n)
        for (const double h : reference_net(coupling.nets[n], p, coupling.parameters[n], inputs)) heads.push_back(h);
      const std::size_t moved = coupling.moved.size();
      for (std::size_t k = 0; k < moved; ++k) {
        double& x = v[static_cast<std::size_t>(coupling.moved[k])];
        const double s = p[coupling.scales + k] * std::tanh(heads[k]), edge = static_cast<double>(kEdge);
        x -= heads[moved + k];
        if (std::abs(x) <= edge * std::exp(s)) {
          x *= std::exp(-s);
          log_q -= s;
        } else {
          x -= std::copysign(edge, x) * (std::exp(s) - 1);
        }
      }
    }
    for (const double x : v) log_q += log_logistic(x);
    return log_q;
  }

 private:
  static double log_logistic(double v) { return -std::abs(v) - 2 * std::log1p(std::exp(-std::abs(v))); }

  const Flow& m_flow;
  std::vector<double> p;
};

}  // namespace warpath::realnvp
