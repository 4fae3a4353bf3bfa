#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "warpath/batch.h"

namespace warpath {

/// The latents of one iteration: replicates that are independent of each other, each a scrambled Sobol' sequence of 2^k
/// points [Owen95] for a proposal's main component and, where there is another one, a second sequence for that, a 32nd
/// as long. So each component has points that are spread well by themselves, whatever the dimension of the whole.
class Points {
 public:
  enum class Kind { independent, sobol };
  static constexpr double kSecondShare = 1.0 / 33;  ///< of points, but in sequences of fewer than 32
  Points() = default;
  /// At most `count` points; with `defended` every replicate has points for a second component.
  Points(Kind kind, std::uint64_t seed, std::uint64_t iteration, std::size_t count, bool defended);

  std::size_t count() const { return m_replicates * replicate_size(); }
  std::size_t replicates() const { return m_replicates; }
  std::size_t replicate_size() const { return m_main + m_second; }

  /// Points `first` ... as rows of z in [0,1); u: in which share of [0,1) they choose the component, given the share of
  /// the second one.
  void fill(std::size_t first, Batch<double> z, std::span<double> u) const;
  /// Share of points that the second component draws; 0 if there is none.
  double second_share() const;

 private:
  Kind m_kind = Kind::independent;
  std::uint64_t m_seed = 0;
  std::size_t m_replicates = 0, m_main = 1, m_second = 0;
  bool m_defended = false;
};

}  // namespace warpath
