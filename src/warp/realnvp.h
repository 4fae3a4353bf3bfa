#pragma once
#include <memory>

#include "warp/proposal.h"
#include "warp/realnvp_flow.h"

namespace warpath {

/// Real NVP [DSB17] over the hypercube as [ZZ19] has it: logit, affine couplings with alternating masks, sigmoid.
/// Networks in float32; the way in and out of logit space and log-densities in float64.
class RealNvp final : public Warp {
 public:
  /// parameters: flow.parameter_count() numbers in the layout of flow.views().
  RealNvp(realnvp::Flow flow, nn::AlignedVector<float> parameters);
  /// The identity, ready to be trained.
  static std::shared_ptr<const RealNvp> untrained(int dims, const RealNvpSettings& settings, std::uint64_t seed);

  int dims() const override { return m_flow.dims(); }
  std::string family() const override { return "realnvp"; }
  const RealNvpSettings& settings() const { return m_flow.settings(); }
  const realnvp::Flow& flow() const { return m_flow; }
  const nn::AlignedVector<float>& parameters() const { return m_parameters; }

  void forward(Batch<const double> z, Batch<double> y, std::span<double> log_det) const override;
  void inverse(Batch<const double> y, Batch<double> z, std::span<double> log_det) const override;
  void save(TensorFile& file, const std::string& prefix) const override;
  static std::shared_ptr<const RealNvp> load(const TensorFile& file, const std::string& prefix);

 private:
  realnvp::Flow m_flow;
  nn::AlignedVector<float> m_parameters;
  PackedParameters m_packed;
};

}  // namespace warpath
