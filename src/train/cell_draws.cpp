#include "train/cell_draws.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace warpath {
namespace {

/// In the choice of a share of uniform numbers a draw counts at most as if it were so many times the mean.
constexpr double kOutshines = 20;
/// Effective samples of a cell that weigh as much as what the cells like it say.
constexpr double kLikeOthers = 64;

double whole(const CellDraws& draws) { return std::accumulate(draws.with_share.begin(), draws.with_share.end(), 0.0); }

}  // namespace

void CellDraws::add(float term, float inv_q) {
  if (learned > 0) {
    // A draw that outshines all others would choose alone.
    const float bound = n > 0 ? static_cast<float>(kOutshines * sum / n) : 0.0f;
    const float f = std::min(term, bound);
    // q is 1 + learned (p - 1), where p is the learned density: so p is known, and q with any other
    // share.
    const float q = 1 / inv_q, beyond_1 = std::max((q - 1) / learned, -1.0f);
    for (std::size_t s = 0; s < with_share.size(); ++s)
      with_share[s] += f * f * q / (1 + (1 - kUniformShares[s]) * beyond_1);
  }
  n += 1, sum += term, square += static_cast<double>(term) * term;
}

void CellDraws::begin_pass(double learned_share) {
  learned = static_cast<float>(learned_share);
  // The density will be a better one: what was drawn with it will soon count more.
  for (float& square_with : with_share) square_with *= 0.5f;
}

void CellDraws::halve() {
  n *= 0.5, sum *= 0.5, square *= 0.5;
  for (float& square_with : with_share) square_with *= 0.5f;
}

void PooledShares::add(const CellDraws& draws) {
  const double all = whole(draws);
  if (!(all > 0)) return;
  const double weight = draws.effective();
  m_weight += weight;
  for (std::size_t s = 0; s < m_sum.size(); ++s) m_sum[s] += weight * draws.with_share[s] / all;
}

std::array<double, kUniformShares.size()> PooledShares::mean() const {
  std::array<double, kUniformShares.size()> mean = m_sum;
  for (double& share : mean) share /= std::max(m_weight, 1.0);
  return mean;
}

double best_uniform_share(const CellDraws& draws, const std::array<double, kUniformShares.size()>& pooled,
                          double otherwise) {
  const double all = whole(draws), weight = all > 0 ? draws.effective() / all : 0;
  double least = HUGE_VAL, best = otherwise;
  for (std::size_t s = 0; s < pooled.size(); ++s) {
    const double square = weight * draws.with_share[s] + kLikeOthers * pooled[s];
    if (square > 0 && square < least) least = square, best = kUniformShares[s];
  }
  return best;
}

}  // namespace warpath
