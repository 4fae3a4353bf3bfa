#include "train/marginals.h"

#include <algorithm>
#include <numeric>

#include "core/rng.h"
#include "warpath/error.h"

namespace warpath {
namespace {

Marginal empty_marginal(int column_x, int column_y, int bins) {
  Marginal marginal{column_x, column_y, bins, {}};
  marginal.density.resize(static_cast<std::size_t>(bins) * static_cast<std::size_t>(bins));
  return marginal;
}

std::size_t bin(double x, double y, int bins) {
  const auto index = [&](double v) { return std::clamp(static_cast<int>(v * bins), 0, bins - 1); };
  return static_cast<std::size_t>(index(y) * bins + index(x));
}

void normalise(Marginal& marginal) {
  const double sum = std::accumulate(marginal.density.begin(), marginal.density.end(), 0.0);
  if (sum <= 0) return;
  const auto scale = static_cast<float>(static_cast<double>(marginal.density.size()) / sum);
  for (float& value : marginal.density) value *= scale;
}

}  // namespace

Marginal target_marginal(const Candidates& candidates, int column_x, int column_y, int bins) {
  Marginal marginal = empty_marginal(column_x, column_y, bins);
  std::vector<float> y(static_cast<std::size_t>(candidates.layout.dims()));
  for (std::uint64_t id = 0; id < candidates.size(); ++id) {
    const float target = candidates.target[id];
    if (!(target > 0)) continue;
    candidates.primary_sample(id, y.data());
    marginal.density[bin(y[static_cast<std::size_t>(column_x)], y[static_cast<std::size_t>(column_y)], bins)] += target;
  }
  normalise(marginal);
  return marginal;
}

Marginal proposal_marginal(const Proposal& proposal, int column_x, int column_y, int bins, std::uint64_t samples) {
  Marginal marginal = empty_marginal(column_x, column_y, bins);
  constexpr std::size_t kBatch = 4096;
  const auto dims = static_cast<std::size_t>(proposal.dims());
  Matrix<double> y(kBatch, dims);
  std::vector<double> u(kBatch), log_q(kBatch);
  for (std::uint64_t first = 0; first < samples; first += kBatch) {
    for (std::size_t i = 0; i < kBatch; ++i) {
      const std::uint64_t key = sample_key(0, first + i);
      for (std::size_t c = 0; c < dims; ++c) y(i, c) = sample_double(key, static_cast<std::uint32_t>(c));
      u[i] = sample_double(key, static_cast<std::uint32_t>(dims));
    }
    proposal.sample(y.batch(), u, y.batch(), log_q);
    for (std::size_t i = 0; i < kBatch; ++i)
      marginal.density[bin(y(i, static_cast<std::size_t>(column_x)), y(i, static_cast<std::size_t>(column_y)), bins)] +=
          1;
  }
  normalise(marginal);
  return marginal;
}

}  // namespace warpath
