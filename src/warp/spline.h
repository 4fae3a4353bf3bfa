#pragma once
#include <memory>

#include "warp/proposal.h"
#include "warp/spline_flow.h"

namespace warpath {

/// Coupling layers of rational-quadratic splines over the hypercube [DBMP19], as [MMRGN19] has them with simpler
/// pieces: the inverse of a coupling maps each moved dimension by the running integral of a density that its network
/// names. Networks and knots in float32; what is between knots, and log-densities, in float64.
class Spline final : public Warp {
 public:
  /// parameters: flow.parameter_count() numbers in the layout of flow.views().
  Spline(spline::Flow flow, nn::AlignedVector<float> parameters);
  /// The identity, ready to be trained.
  static std::shared_ptr<const Spline> untrained(int dims, const SplineSettings& settings, std::uint64_t seed);

  int dims() const override { return m_flow.dims(); }
  std::string family() const override { return "spline"; }
  const SplineSettings& settings() const { return m_flow.settings(); }
  const spline::Flow& flow() const { return m_flow; }
  const nn::AlignedVector<float>& parameters() const { return m_parameters; }

  void forward(Batch<const double> z, Batch<double> y, std::span<double> log_det) const override;
  void inverse(Batch<const double> y, Batch<double> z, std::span<double> log_det) const override;
  void save(TensorFile& file, const std::string& prefix) const override;
  static std::shared_ptr<const Spline> load(const TensorFile& file, const std::string& prefix);

 private:
  spline::Flow m_flow;
  nn::AlignedVector<float> m_parameters;
  PackedParameters m_packed;
};

}  // namespace warpath
