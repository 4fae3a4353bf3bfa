#pragma once
#include <cmath>
#include <vector>

#include "warp/net_reference.h"
#include "warp/spline_flow.h"
#include "warp/spline_kernels.h"

namespace warpath::spline {

/// z = S(y) and ln S'(y) as [DBMP19] writes them, in doubles, for one sample. heads: head_rows(bins) numbers.
struct ReferenceSpline {
  double z, log_slope;

  ReferenceSpline(int bins, const double* heads, double y) {
    const std::size_t count = static_cast<std::size_t>(bins);
    const auto knots = [&](const double* h) {
      double sum = 0;
      for (std::size_t j = 0; j < count; ++j) sum += std::exp2(h[j]);
      std::vector<double> at{0};
      const double least = static_cast<double>(kLeastShare);
      for (std::size_t j = 0; j < count; ++j)
        at.push_back(at.back() + least / bins + (1 - least) * std::exp2(h[j]) / sum);
      return at;
    };
    const auto slope = [&](std::size_t j) {
      const double h = heads[2 * count + j];
      return std::exp2(h / (1 + std::abs(h) / static_cast<double>(kMostSlope)));
    };
    const std::vector<double> y_at = knots(heads), z_at = knots(heads + count);
    std::size_t k = 0;
    while (k + 1 < count && y >= y_at[k + 1]) ++k;
    const double w = y_at[k + 1] - y_at[k], h = z_at[k + 1] - z_at[k], s = h / w, xi = (y - y_at[k]) / w;
    const double d0 = slope(k), d1 = slope(k + 1), t = xi * (1 - xi), den = s + (d0 + d1 - 2 * s) * t;
    z = z_at[k] + h * (s * xi * xi + d0 * t) / den;
    log_slope = std::log(s * s * (d1 * xi * xi + 2 * s * t + d0 * (1 - xi) * (1 - xi)) / (den * den));
  }
};

/// ln q(y) in plain loops and doubles, one sample at a time: what the kernels are tested against.
class Reference {
 public:
  Reference(const Flow& flow, std::vector<double> parameters) : m_flow(flow), p(std::move(parameters)) {}
  std::vector<double>& parameters() { return p; }

  double log_density(std::vector<double> y, const std::vector<double>& context = {}) const {
    const SplineSettings& settings = m_flow.settings();
    double log_q = 0;
    for (std::size_t c = m_flow.couplings().size(); c-- > 0;) {
      const Coupling& coupling = m_flow.couplings()[c];
      std::vector<double> inputs = context;
      for (const int k : coupling.kept) {
        const double u = y[static_cast<std::size_t>(k)];
        inputs.push_back(2 * u - 1);
        for (int bin = 0; bin < settings.encoding_bins; ++bin) {
          const double t = (settings.encoding_bins * u - bin - 0.5) / static_cast<double>(kBlobRadius);
          inputs.push_back(std::abs(t) < 1 ? (1 - t * t) * (1 - t * t) : 0);
        }
      }
      const std::vector<double> heads = reference_net(coupling.net, p, coupling.parameters, inputs);
      for (std::size_t k = 0; k < coupling.moved.size(); ++k) {
        double& x = y[static_cast<std::size_t>(coupling.moved[k])];
        const ReferenceSpline spline(settings.bins, &heads[k * static_cast<std::size_t>(head_rows(settings.bins))], x);
        x = spline.z;
        log_q += spline.log_slope;
      }
    }
    return log_q;
  }

 private:
  const Flow& m_flow;
  std::vector<double> p;
};

}  // namespace warpath::spline
