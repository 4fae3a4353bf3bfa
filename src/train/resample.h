#pragma once
#include <limits>

#include "train/training_data.h"

namespace warpath {

/// Sample-importance resampling [TCE05]: `count` examples drawn from the candidates with probability proportional to g,
/// so that they follow the density of g. Stratified: example k lies at (k + u_k) / count of the running sum, so that a
/// candidate's number of copies is within two of its expectation. Weights are 1, inv_q is mean g / g. A g above `most`
/// counts as `most`: rare bright paths teach a density less than they cost. Rows stand in the order of the candidates:
/// copies of one are adjacent (a bright candidate has many, and all of them say the same: hold out whole ranges of
/// rows, or a fit is judged by what it was fitted to), and a minibatch must be shuffled by who takes it. Empty if no
/// candidate has g > 0. Sums are in double, and the same for any number of threads.
Examples resample(const Candidates& candidates, std::uint64_t count, std::uint64_t seed,
                  float most = std::numeric_limits<float>::infinity());

/// The candidates first ... first + count - 1 with their targets as weights, those with g = 0 among them.
Examples weighted_examples(const Candidates& candidates, std::uint64_t first, std::uint64_t count);

/// Mean of g over all candidates, and its square: sum and effective number of resampled candidates follow from them.
struct TargetMoments {
  double mean = 0, mean_square = 0;
  /// (sum g)^2 / sum g^2: how many equally bright candidates would be worth as much.
  double effective_count(std::uint64_t count) const {
    return mean_square > 0 ? static_cast<double>(count) * mean * mean / mean_square : 0;
  }
};
TargetMoments target_moments(const Candidates& candidates);

}  // namespace warpath
