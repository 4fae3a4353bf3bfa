#pragma once
#include "warp/load.h"
#include "warp/proposal.h"

namespace warpath {

/// One warp after another, y = outer(inner(z)): `inner` learns what `outer` left over, q(y) = q_outer(y) q_inner(x)
/// with x = outer^-1(y).
class Chain : public Warp {
 public:
  Chain(std::shared_ptr<const Warp> inner, std::shared_ptr<const Warp> outer);

  const std::shared_ptr<const Warp>& inner() const { return m_inner; }
  const std::shared_ptr<const Warp>& outer() const { return m_outer; }
  int dims() const override { return m_outer->dims(); }
  std::string family() const override { return "chain"; }
  void forward(Batch<const double> z, Batch<double> y, std::span<double> log_det) const override;
  void inverse(Batch<const double> y, Batch<double> z, std::span<double> log_det) const override;
  void save(TensorFile& file, const std::string& prefix) const override;
  static std::shared_ptr<const Chain> load(const TensorFile& file, const std::string& prefix,
                                           const ProposalLoader& load_part);

 private:
  std::shared_ptr<const Warp> m_inner, m_outer;
};

}  // namespace warpath
