#pragma once
#include "warp/proposal.h"

namespace warpath {

/// The identity: q = 1.
class Uniform : public Warp {
 public:
  explicit Uniform(int dims);
  int dims() const override { return m_dims; }
  std::string family() const override { return "uniform"; }
  void forward(Batch<const double> z, Batch<double> y, std::span<double> log_det) const override;
  void inverse(Batch<const double> y, Batch<double> z, std::span<double> log_det) const override;
  void log_density(Batch<const double> y, std::span<double> log_q) const override;
  void save(TensorFile& file, const std::string& prefix) const override;
  static std::shared_ptr<const Uniform> load(const TensorFile& file, const std::string& prefix);

 private:
  int m_dims;
};

}  // namespace warpath
