#pragma once
#include <limits>
#include <utility>
#include <vector>

#include "train/training_data.h"

namespace warpath {

/// Examples that were drawn from candidates: their ids and targets. y is made again whenever it is asked for, so an
/// example costs 12 bytes, whatever its dimensions.
class ResampledExamples final : public TrainingSet {
 public:
  std::size_t size() const override { return m_ids.size(); }
  std::size_t dims() const override { return static_cast<std::size_t>(m_layout.dims()); }
  void primary_sample(std::size_t i, float* y) const override;
  float weight(std::size_t) const override { return 1; }
  float target(std::size_t i) const override { return m_target[i]; }  ///< g / its mean over the candidates
  std::uint64_t id(std::size_t i) const { return m_ids[i]; }          ///< of the candidate

 private:
  friend class Resampler;
  Layout m_layout;
  std::uint64_t m_seed = 0;
  std::vector<std::uint64_t> m_ids;
  std::vector<float> m_target;
};

/// Sample-importance resampling [TCE05]: `count` examples drawn from `candidates` candidates with probability
/// proportional to g, so that they follow the density of g. The candidates come in chunks, in their order, and are not
/// needed afterwards. Systematic: example k lies at (k + u_k) x step of the running sum of g, so that a candidate's
/// number of copies is within two of its expectation. The step is told by the mean of g over the first chunk that has
/// any light: candidates in one piece give exactly `count` examples, in several about as many. A g above `most` counts
/// as `most`: rare bright paths teach a density less than they cost. Examples stand in the order of the candidates:
/// copies of one are adjacent (a bright candidate has many, and all of them say the same: hold out whole ranges of
/// them, or a fit is judged by what it was fitted to), and a minibatch must be shuffled by who takes it. Sums are in
/// double, and the same for any number of threads.
class Resampler {
 public:
  Resampler(Layout layout, std::uint64_t candidates, std::uint64_t count, std::uint64_t seed);
  /// Chunks must follow each other without a gap, and come from the same layout and seed.
  void add(const Candidates& chunk, float most = std::numeric_limits<float>::infinity());
  /// What was drawn; empty if no candidate has g > 0.
  ResampledExamples take() && { return std::move(m_examples); }

 private:
  double point(std::uint64_t k) const;
  std::uint64_t first_point_from(double sum) const;

  std::uint64_t m_candidates, m_count, m_stream;
  std::uint64_t m_seen = 0;      // candidates
  double m_sum = 0, m_step = 0;  // of g so far; of g for each example
  ResampledExamples m_examples;
};

/// The same from candidates in one piece.
ResampledExamples resample(const Candidates& candidates, std::uint64_t count, std::uint64_t seed,
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
