#include "train/resample.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <map>

#include "core/rng.h"
#include "train/test_integrand.h"

namespace warpath {
namespace {

Candidates with_targets(std::vector<float> targets) {
  Candidates candidates;
  candidates.layout = Layout::parse("film");
  candidates.target = std::move(targets);
  return candidates;
}

/// Targets of which some are 0 and some very bright.
Candidates uneven(std::size_t count) {
  std::vector<float> targets(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float u = sample_float(sample_key(1, i), 0);
    targets[i] = u < 0.3f ? 0 : 1 / (1.0001f - u);
  }
  return with_targets(std::move(targets));
}

/// How often each candidate was drawn, found again by its y.
std::vector<int> copies(const Candidates& candidates, const ResampledExamples& examples) {
  std::map<std::pair<float, float>, std::size_t> ids;
  float y[2];
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    candidates.primary_sample(i, y);
    ids[{y[0], y[1]}] = i;
  }
  std::vector<int> count(candidates.size());
  for (std::size_t k = 0; k < examples.size(); ++k) {
    examples.primary_sample(k, y);
    ++count[ids.at({y[0], y[1]})];
  }
  return count;
}

/// Candidates begin ... end - 1 alone, as a chunk.
Candidates piece(const Candidates& candidates, std::size_t begin, std::size_t end) {
  Candidates chunk = candidates;
  chunk.first = begin;
  chunk.target.assign(candidates.target.begin() + static_cast<std::ptrdiff_t>(begin),
                      candidates.target.begin() + static_cast<std::ptrdiff_t>(end));
  return chunk;
}

TEST(Resample, CopiesAreWithinTwoOfTheirExpectation) {
  const Candidates candidates = uneven(100'000);  // several blocks
  const ResampledExamples examples = resample(candidates, 50'000, 7);
  ASSERT_EQ(examples.size(), 50'000u);
  const double total = target_moments(candidates).mean * static_cast<double>(candidates.size());
  const std::vector<int> count = copies(candidates, examples);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const double expected = 50'000 * candidates.target[i] / total;
    EXPECT_LE(std::fabs(count[i] - expected), 2.0) << i;
    if (candidates.target[i] == 0) {
      EXPECT_EQ(count[i], 0) << i;
    }
  }
}

TEST(Resample, TargetsAreCutOff) {
  const Candidates candidates = with_targets({1, 0, 100, 3});
  const ResampledExamples examples = resample(candidates, 8'000, 7, 4.0f);
  const std::vector<int> count = copies(candidates, examples);
  EXPECT_NEAR(count[0], 1'000, 2);
  EXPECT_EQ(count[1], 0);
  EXPECT_NEAR(count[2], 4'000, 2);
  EXPECT_NEAR(count[3], 3'000, 2);
  for (std::size_t k = 0; k < examples.size(); ++k)
    if (examples.id(k) == 2) {
      EXPECT_FLOAT_EQ(examples.target(k), 4 / 2.0f) << "g / mean g, both cut off";
    }
}

TEST(Resample, IsUnbiased) {
  // The mean number of copies over seeds; each is a sum of two or three coins, so its variance is below 3/4.
  const Candidates candidates = with_targets({1, 0, 2, 0.5f, 4, 0, 1.5f});
  constexpr int kSeeds = 4000;
  std::vector<double> mean(candidates.size());
  for (int seed = 0; seed < kSeeds; ++seed) {
    const std::vector<int> count = copies(candidates, resample(candidates, 5, static_cast<std::uint64_t>(seed)));
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += count[i] / static_cast<double>(kSeeds);
  }
  for (std::size_t i = 0; i < mean.size(); ++i)  // 5 standard errors: 6e-7 each
    EXPECT_NEAR(mean[i], 5 * candidates.target[i] / 9, 5 * std::sqrt(0.75 / kSeeds)) << i;
}

TEST(Resample, HoldsAtTheEdges) {
  EXPECT_EQ(resample(with_targets({}), 10, 1).size(), 0u);
  EXPECT_EQ(resample(with_targets({0, 0, 0}), 10, 1).size(), 0u);
  EXPECT_EQ(resample(with_targets({0, 1e-30f, 0}), 10, 1).size(), 10u);
  std::vector<float> last(40'000, 0.0f);  // all light in the last block but one
  last[30'000] = 3e38f;
  const Candidates candidates = with_targets(last);
  const ResampledExamples examples = resample(candidates, 100, 1);
  ASSERT_EQ(examples.size(), 100u);
  EXPECT_EQ(copies(candidates, examples)[30'000], 100);
}

TEST(Resample, FollowsTheTarget) {
  const Candidates candidates = gather_candidates(bump(2), Layout::parse("film"), 2, 400'000);
  const ResampledExamples examples = resample(candidates, 50'000, 3);
  double mean = 0, variance = 0;
  for (std::size_t i = 0; i < examples.size(); ++i) {
    float y[2];
    examples.primary_sample(i, y);
    mean += y[0] / 50'000;
    variance += (y[0] - 0.5) * (y[0] - 0.5) / 50'000;
  }
  EXPECT_NEAR(mean, 0.5, 5 * 0.15 / std::sqrt(50'000.0));
  EXPECT_NEAR(variance, 0.15 * 0.15 * 0.983, 0.0005);  // of a Gaussian cut off at 3.3 widths
}

TEST(Resample, IsTheSameForAnyNumberOfThreads) {
  const Candidates candidates = uneven(200'000);
  const auto with_threads = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const ResampledExamples examples = resample(candidates, 30'000, 1);
    std::vector<std::uint64_t> ids;
    for (std::size_t i = 0; i < examples.size(); ++i) ids.push_back(examples.id(i));
    return ids;
  };
  EXPECT_EQ(with_threads(1), with_threads(2));
}

TEST(Resample, ChunksGiveWhatOnePieceGives) {
  // The step is told by the first chunk, so copies are within two of what that promises, and never missing.
  const Candidates candidates = uneven(100'000);
  Resampler resampler(candidates.layout, candidates.size(), 50'000, 7);
  for (std::size_t begin = 0; begin < 100'000; begin += 40'000)
    resampler.add(piece(candidates, begin, std::min<std::size_t>(100'000, begin + 40'000)));
  const ResampledExamples examples = std::move(resampler).take();
  const double first_mean = target_moments(piece(candidates, 0, 40'000)).mean;
  const std::vector<int> count = copies(candidates, examples);
  double total = 0;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const double expected = 0.5 * candidates.target[i] / first_mean;
    total += expected;
    EXPECT_LE(std::fabs(count[i] - expected), 2.0) << i;
  }
  EXPECT_NEAR(static_cast<double>(examples.size()), total, 2);
  for (std::size_t k = 1; k < examples.size(); ++k) ASSERT_LE(examples.id(k - 1), examples.id(k));
  for (std::size_t k = 0; k < examples.size(); k += 997)
    EXPECT_FLOAT_EQ(examples.target(k), static_cast<float>(candidates.target[examples.id(k)] / first_mean));
}

TEST(Resample, DarkChunksArePassedOver) {
  const Candidates candidates = with_targets({0, 0, 0, 2, 1, 1});
  Resampler resampler(candidates.layout, 6, 8'000, 7);
  for (std::size_t begin = 0; begin < 6; begin += 2) resampler.add(piece(candidates, begin, begin + 2));
  const std::vector<int> count = copies(candidates, std::move(resampler).take());
  // After two chunks of three the mean is 0.5: 8,000 examples of six candidates are 8,000 / 3 for each unit of g.
  EXPECT_NEAR(count[3], 16'000 / 3.0, 2);
  EXPECT_NEAR(count[4], 8'000 / 3.0, 2);
  EXPECT_NEAR(count[5], 8'000 / 3.0, 2);
}

TEST(WeightedExamples, AreTheCandidates) {
  const Candidates candidates = uneven(50'000);
  const Examples examples = weighted_examples(candidates, 100, 40'000);
  ASSERT_EQ(examples.size(), 40'000u);
  for (const std::size_t i : {0u, 20'000u, 39'999u}) {
    float y[2];
    candidates.primary_sample(100 + i, y);
    EXPECT_EQ(examples.y(i, 0), y[0]);
    EXPECT_EQ(examples.y(i, 1), y[1]);
    EXPECT_EQ(examples.weight[i], candidates.target[100 + i]);
  }
}

TEST(TargetMoments, AreThoseOfTheTargets) {
  const TargetMoments moments = target_moments(with_targets({1, 0, 2, 3}));
  EXPECT_DOUBLE_EQ(moments.mean, 1.5);
  EXPECT_DOUBLE_EQ(moments.mean_square, 3.5);
  EXPECT_NEAR(moments.effective_count(4), 36.0 / 14, 1e-12);
}

}  // namespace
}  // namespace warpath
