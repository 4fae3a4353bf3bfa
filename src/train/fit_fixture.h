#pragma once
#include <cmath>
#include <vector>

#include "train/resample.h"
#include "train/test_integrand.h"
#include "warp/proposal.h"

// What tests of fits share: examples of a test integrand, and how good a density is.
namespace warpath {

inline Examples examples_of(const TestIntegrand& integrand, std::uint64_t count, std::uint64_t seed = 1) {
  const Candidates candidates = gather_candidates(integrand, layout_of(integrand.dims()), seed, count);
  return weighted_examples(candidates, 0, count);
}

/// Second moment of f / q over the square of f's integral: 1 is perfect.
inline double second_moment(const TestIntegrand& integrand, const Proposal& proposal) {
  const Examples examples = examples_of(integrand, 100'000, 99);
  Matrix<double> y(examples.size(), examples.y.cols());
  for (std::size_t k = 0; k < y.values().size(); ++k) y.values()[k] = examples.y.values()[k];
  std::vector<double> log_q(examples.size());
  proposal.log_density(y.batch(), log_q);
  double mean = 0, square = 0;
  for (std::size_t i = 0; i < examples.size(); ++i) {
    const double f = examples.weight[i];
    mean += f / 100'000;
    square += f * f * std::exp(-log_q[i]) / 100'000;
  }
  return square / (mean * mean);
}

}  // namespace warpath
