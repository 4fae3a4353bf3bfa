#include "integrate/replicate_sums.h"

#include <algorithm>
#include <cmath>

#include "warpath/error.h"

namespace warpath {

ReplicateSums::ReplicateSums(std::size_t integrals, std::size_t replicate_size)
    : m_size(replicate_size),
      m_sum(integrals),
      m_mean(integrals),
      m_square(integrals * integrals),
      m_change(integrals) {}

void ReplicateSums::add(Batch<const double> f, std::span<const double> weight) {
  WARPATH_CHECK_EQ(f.cols(), m_sum.size());
  for (std::size_t i = 0; i < f.rows(); ++i) {
    const auto values = f.row(i);
    if (std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })) {
      for (std::size_t c = 0; c < values.size(); ++c) m_sum[c] += weight[i] * values[c];
      const double w = std::abs(weight[i] * values[0]);
      m_abs += w;
      m_abs_square += w * w;
      m_largest = std::max(m_largest, w);
    } else {
      ++m_non_finite;
    }
    if (++m_count % m_size == 0) end_replicate();
  }
}

void ReplicateSums::end_replicate() {
  const std::size_t n = m_mean.size();
  ++m_replicates;
  for (std::size_t c = 0; c < n; ++c) {
    m_sum[c] /= static_cast<double>(m_size);
    m_change[c] = m_sum[c] - m_mean[c];
    m_mean[c] += m_change[c] / static_cast<double>(m_replicates);
  }
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = 0; b < n; ++b) m_square[a * n + b] += m_change[a] * (m_sum[b] - m_mean[b]);
  std::fill(m_sum.begin(), m_sum.end(), 0.0);
}

Iteration ReplicateSums::result() const {
  Iteration result;
  result.mean = m_mean;
  result.covariance = m_square;
  const double r = static_cast<double>(m_replicates);
  for (double& value : result.covariance) value /= r * (r - 1);
  result.neval = m_count;
  result.replicates = m_replicates;
  result.non_finite = m_non_finite;
  if (m_abs > 0) {
    result.effective_samples = m_abs * m_abs / m_abs_square;
    result.unweighting_efficiency = m_abs / static_cast<double>(m_count) / m_largest;
  }
  return result;
}

}  // namespace warpath
