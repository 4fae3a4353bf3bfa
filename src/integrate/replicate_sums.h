#pragma once
#include <cstdint>
#include <span>

#include "warpath/batch.h"
#include "warpath/integrator.h"

namespace warpath {

/// Mean and covariance of C estimates from the means of replicates (Welford's recurrence over them).
class ReplicateSums {
 public:
  ReplicateSums() = default;
  ReplicateSums(std::size_t integrals, std::size_t replicate_size);

  /// The next points, in order: f: N x C, weight: N. A row with a value that is not finite counts as zero.
  void add(Batch<const double> f, std::span<const double> weight);
  std::size_t count() const { return m_count; }
  /// Of whole replicates.
  Iteration result() const;

 private:
  void end_replicate();

  std::size_t m_size = 1, m_count = 0, m_replicates = 0;
  std::uint64_t m_non_finite = 0;
  std::vector<double> m_sum;  // of the replicate under way
  std::vector<double> m_mean, m_square, m_change;
  double m_abs = 0, m_abs_square = 0, m_largest = 0;  // |w| of the first integral
};

}  // namespace warpath
