#include "train/fit_spline.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <cmath>

#include "core/interrupt.h"
#include "core/rng.h"
#include "warp/check.h"
#include "warp/spline.h"
#include "warp/uniform.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using Loss = SplineSettings::Loss;

SplineSettings small() {
  SplineSettings s;
  s.couplings = 2;
  s.width = 16;
  s.bins = 8;
  s.encoding_bins = 8;
  s.batch = 512;
  s.rate = 5e-3;
  s.average = 0.95;
  s.loss = Loss::likelihood;
  s.max_steps = 150;
  s.evaluate_every = 25;
  return s;
}

/// The density prod_d 2 y_d of independent ramps, but y_0 rises where y_1 < 1/2 and falls elsewhere: only a coupling
/// tells one from the other.
Examples ramps(int dims, std::size_t count) {
  Examples examples{Matrix<float>(count, static_cast<std::size_t>(dims)), std::vector<float>(count, 1.0f), {}};
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t key = sample_key(11, i);
    for (std::size_t d = 0; d < examples.y.cols(); ++d)
      examples.y(i, d) = std::min(std::sqrt(sample_float(key, static_cast<std::uint32_t>(d))), 0x1.fffffep-1f);
    if (dims > 1 && examples.y(i, 1) >= 0.5f) examples.y(i, 0) = 1 - examples.y(i, 0);
    if (examples.y(i, 0) >= 1) examples.y(i, 0) = 0;
  }
  return examples;
}
/// Entropy of a ramp; that of D of them is D times as much.
const double kRamp = 0.5 - std::log(2.0);

/// KL divergence of what was learned from the density of the ramps, over examples that were not trained on.
double divergence(const Proposal& proposal) {
  const int dims = proposal.dims();
  const Examples all = ramps(dims, 60'000);
  const std::size_t first = 40'000, count = all.size() - first, cols = static_cast<std::size_t>(dims);
  Matrix<double> y(count, cols);
  std::vector<double> log_q(count);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t d = 0; d < cols; ++d) y(i, d) = static_cast<double>(all.y(first + i, d));
  proposal.log_density(y.batch(), log_q);
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t d = 0; d < cols; ++d) {
      const bool falls = d == 0 && dims > 1 && y(i, 1) >= 0.5;
      sum += std::log(2 * std::max(falls ? 1 - y(i, d) : y(i, d), 1e-7));
    }
    sum -= log_q[i];
  }
  return sum / static_cast<double>(count);
}

const Spline& spline_of(const Fit& fit) { return dynamic_cast<const Spline&>(*fit.proposal); }

TEST(FitSpline, LearnsAKnownDensity) {
  for (const int dims : {1, 2, 4}) {
    SplineSettings s = small();
    s.max_steps = 500;
    const Fit fit = fit_spline(ExampleSet(ramps(dims, 40'000)), s, 1);
    EXPECT_NEAR(divergence(*Spline::untrained(dims, s, 1)), -dims * kRamp, 0.02 * dims);
    EXPECT_LT(divergence(*fit.proposal), 0.015 * dims) << dims;
    EXPECT_GT(divergence(*fit.proposal), -0.001) << dims;
    EXPECT_NEAR(fit.log.points.front().held_out, 0, 1e-6) << "untrained: the identity";
  }
}

TEST(FitSpline, KeepsEveryPromiseWhenTrained) {
  for (const int dims : {1, 2, 3, 4, 5, 8, 16, 32}) {
    SplineSettings s = small();
    s.max_steps = dims > 8 ? 75 : 150;
    const Fit fit = fit_spline(ExampleSet(ramps(dims, 5'000)), s, 2);
    EXPECT_LT(fit.log.points.back().held_out, 0.5 * kRamp) << dims;
    CheckOptions options;  // float32 networks
    options.log_q_tolerance = 1e-4;
    options.difference_step = 2e-4;
    options.log_det_tolerance = 2e-2;
    options.kink = 2e-2;
    EXPECT_EQ(check_proposal(*fit.proposal, options), "");
    EXPECT_EQ(check_warp(spline_of(fit), options), "");
  }
}

TEST(FitSpline, SameBitsForAnyNumberOfThreads) {
  std::vector<nn::AlignedVector<float>> parameters;
  for (const std::size_t threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    SplineSettings s = small();
    s.max_steps = 30;
    s.evaluate_every = 10;
    parameters.push_back(spline_of(fit_spline(ExampleSet(ramps(3, 4'000)), s, 4)).parameters());
  }
  EXPECT_EQ(parameters[0], parameters[1]);
  EXPECT_EQ(parameters[0], parameters[2]);
}

// Examples drawn by g, with g known: E[g / q] is 1 where q = g, E[g] where q = 1.
TEST(FitSpline, LowersTheVariance) {
  Examples examples = ramps(1, 20'000);
  for (std::size_t i = 0; i < examples.size(); ++i) examples.inv_q.push_back(1 / std::max(2 * examples.y(i, 0), 1e-3f));
  SplineSettings s = small();
  s.loss = Loss::variance;
  s.expected_uniform_share = 0.05;
  s.max_steps = 400;
  const auto& points = fit_spline(ExampleSet(examples), s, 1).log.points;
  EXPECT_NEAR(points.front().held_out, std::log(4.0 / 3), 0.02);
  EXPECT_LT(points.back().held_out, 0.05);
  EXPECT_GT(points.back().held_out, 0 - 0.03);
}

TEST(FitSpline, WeightsStandForRepetition) {
  // y uniform with weight 2 y is the ramp.
  Examples weighted{Matrix<float>(20'000, 1), std::vector<float>(20'000), {}};
  for (std::size_t i = 0; i < weighted.size(); ++i) {
    weighted.y(i, 0) = sample_float(3, static_cast<std::uint32_t>(i));
    weighted.weight[i] = 100 * weighted.y(i, 0);
  }
  SplineSettings s = small();
  s.max_steps = 400;
  EXPECT_LT(divergence(*fit_spline(ExampleSet(weighted), s, 1).proposal), 0.02);
}

TEST(FitSpline, StartsFromSavedWeights) {
  SplineSettings s = small();
  const Examples examples = ramps(2, 10'000);
  const Fit first = fit_spline(ExampleSet(examples), s, 1);
  const Fit second = fit_spline(ExampleSet(examples), s, 1, first.proposal.get());
  EXPECT_LT(second.log.points.front().held_out, first.log.points[1].held_out);
  s.bins = 9;
  EXPECT_THROW(fit_spline(ExampleSet(examples), s, 1, first.proposal.get()), ConfigError);
  EXPECT_THROW(fit_spline(ExampleSet(examples), s, 1, std::make_unique<Uniform>(2).get()), ConfigError);
}

TEST(FitSpline, EndsWhenInterrupted) {
  g_interrupted = true;
  EXPECT_THROW(fit_spline(ExampleSet(ramps(2, 1'000)), small(), 1), Interrupted);
  g_interrupted = false;
}

TEST(FitSpline, SettingsThatMakeNoSense) {
  SplineSettings s = small();
  s.bins = 1;
  EXPECT_THROW(fit_spline(ExampleSet(ramps(2, 100)), s, 1), ConfigError);
  s = small();
  s.held_out = 1;
  EXPECT_THROW(fit_spline(ExampleSet(ramps(2, 100)), s, 1), ConfigError);
}

}  // namespace
}  // namespace warpath
