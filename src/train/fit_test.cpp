#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "core/rng.h"
#include "train/fit_fixture.h"
#include "train/fit_grid.h"
#include "train/fit_kdtree.h"
#include "warp/check.h"
#include "warp/mixture.h"
#include "warp/uniform.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using Split = KdTreeSettings::Split;
using Target = KdTreeSettings::Target;

/// f is 1 or, where another number of the path falls below 1 - y, 0: mean 1 - y, second moment the same.
TestIntegrand noisy_ramp() {
  return {1, 1, [](auto y, auto f) {
            const auto bits = static_cast<std::uint64_t>(y[0] * 0x1p24);
            f[0] = to_unit_double(mix64(bits + 1)) < 1 - y[0];
          }};
}

TEST(FitKdTree, FindsAStep) {
  const TestIntegrand step(2, 1, [](auto y, auto f) { f[0] = y[1] < 0.25 ? 7 : 1; });
  KdTreeSettings settings;
  settings.max_leaves = 2;
  settings.shrink = 0;
  for (const Target target : {Target::mean, Target::second_moment}) {
    settings.target = target;
    const auto tree = fit_kdtree(examples_of(step, 20'000), settings);
    ASSERT_EQ(tree->leaf_count(), 2u);
    EXPECT_EQ(tree->nodes().dim[0], 1);
    EXPECT_EQ(tree->nodes().y_split[0], 0.25f);
    EXPECT_NEAR(tree->nodes().z_split[0], 0.7f, 1e-5);
  }
}

TEST(FitKdTree, CyclicSplitsHalveTheDimensionsInTurn) {
  KdTreeSettings settings;
  settings.split = Split::cyclic;
  settings.max_leaves = 8;
  const auto tree = fit_kdtree(examples_of(bump(3), 20'000), settings);
  ASSERT_EQ(tree->leaf_count(), 8u);
  EXPECT_EQ(tree->nodes().dim[0], 0);
  EXPECT_EQ(tree->nodes().y_split[0], 0.5f);
  EXPECT_EQ(tree->nodes().dim[1], 1);
  EXPECT_EQ(tree->nodes().dim[2], 1);
}

TEST(FitKdTree, TargetsAreMeanAndRootMeanSquare) {
  KdTreeSettings settings;
  settings.max_leaves = 64;
  const Examples examples = examples_of(noisy_ramp(), 400'000);
  Matrix<double> y(2, 1);
  y.values() = {0.1, 0.7};
  std::vector<double> log_q(2);
  fit_kdtree(examples, settings)->log_density(y.batch(), log_q);
  EXPECT_NEAR(std::exp(log_q[0] - log_q[1]), 0.9 / 0.3, 0.3);
  settings.target = Target::second_moment;
  fit_kdtree(examples, settings)->log_density(y.batch(), log_q);
  EXPECT_NEAR(std::exp(log_q[0] - log_q[1]), std::sqrt(0.9 / 0.3), 0.15);
}

TEST(FitKdTree, LowersTheVariance) {
  for (const int dims : {1, 2, 4}) {
    const TestIntegrand integrand = bump(dims);
    const double before = second_moment(integrand, Uniform(dims));
    for (const Split split : {Split::cyclic, Split::best})
      for (const Target target : {Target::mean, Target::second_moment}) {
        KdTreeSettings settings;
        settings.split = split;
        settings.target = target;
        const auto tree = fit_kdtree(examples_of(integrand, 200'000), settings);
        const double after = second_moment(integrand, *tree);
        EXPECT_LT(after - 1, (before - 1) / (dims == 4 ? 15 : 50)) << dims << "D, before " << before;
      }
  }
}

TEST(FitKdTree, KeepsLeavesLargeAndBounded) {
  KdTreeSettings settings;
  settings.min_samples = 1000;
  const auto tree = fit_kdtree(examples_of(bump(2), 50'000), settings);
  EXPECT_LE(tree->leaf_count(), 50u);
  EXPECT_GT(tree->leaf_count(), 10u);
  settings.min_samples = 10;
  settings.max_leaves = 100;
  EXPECT_EQ(fit_kdtree(examples_of(bump(2), 50'000), settings)->leaf_count(), 100u);
}

TEST(FitKdTree, LeavesNoRegionWithoutDensity) {
  const TestIntegrand corner(2, 1, [](auto y, auto f) { f[0] = y[0] < 0.1 && y[1] < 0.1; });
  KdTreeSettings settings;
  settings.shrink = 0;
  const auto tree = fit_kdtree(examples_of(corner, 100'000), settings);
  Matrix<double> y(1, 2);
  y.values() = {0.9, 0.9};
  std::vector<double> log_q(1);
  tree->log_density(y.batch(), log_q);
  EXPECT_GT(log_q[0], std::log(0.5e-3));
  EXPECT_EQ(check_proposal(*tree), "");
}

TEST(FitKdTree, LearnsFromExamplesOfAnyDensity) {
  // Examples drawn from a tree, with 1 / q, teach what uniform ones teach.
  const TestIntegrand integrand = bump(2);
  KdTreeSettings settings;
  settings.max_leaves = 256;
  const auto first = fit_kdtree(examples_of(integrand, 50'000), settings);
  const Mixture mixture({{first, 0.8}, {std::make_shared<Uniform>(2), 0.2}});
  constexpr std::size_t kCount = 200'000;
  Matrix<double> z(kCount, 2), y(kCount, 2), f(kCount, 1);
  std::vector<double> u(kCount), log_q(kCount);
  for (std::size_t i = 0; i < kCount; ++i) {
    z(i, 0) = sample_double(sample_key(4, i), 0);
    z(i, 1) = sample_double(sample_key(4, i), 1);
    u[i] = sample_double(sample_key(4, i), 2);
  }
  mixture.sample(z.batch(), u, y.batch(), log_q);
  integrand.evaluate(y.batch(), {}, f.batch());
  Examples examples{Matrix<float>(kCount, 2), std::vector<float>(kCount), std::vector<float>(kCount)};
  for (std::size_t i = 0; i < kCount; ++i) {
    examples.y(i, 0) = static_cast<float>(y(i, 0));
    examples.y(i, 1) = static_cast<float>(y(i, 1));
    examples.inv_q[i] = static_cast<float>(std::exp(-log_q[i]));
    examples.weight[i] = static_cast<float>(f(i, 0)) * examples.inv_q[i];
  }
  const double uniform = second_moment(integrand, *fit_kdtree(examples_of(integrand, kCount), settings));
  for (const Target target : {Target::mean, Target::second_moment}) {
    settings.target = target;
    EXPECT_LT(second_moment(integrand, *fit_kdtree(examples, settings)) - 1, 1.5 * (uniform - 1));
  }
}

TEST(FitKdTree, IsTheSameForAnyNumberOfThreads) {
  const Examples examples = examples_of(bump(4), 300'000);
  const auto with_threads = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return fit_kdtree(examples, {})->nodes();
  };
  const KdTree::Nodes one = with_threads(1), two = with_threads(2);
  EXPECT_EQ(one.dim, two.dim);
  EXPECT_EQ(one.y_split, two.y_split);
  EXPECT_EQ(one.z_split, two.z_split);
}

TEST(FitKdTree, SettingsThatMakeNoSenseAreRefused) {
  const Examples examples = examples_of(bump(1), 100);
  KdTreeSettings settings;
  settings.max_leaves = 0;
  EXPECT_THROW(fit_kdtree(examples, settings), ConfigError);
  settings = {};
  settings.min_samples = 0;
  EXPECT_THROW(fit_kdtree(examples, settings), ConfigError);
  settings = {};
  settings.shrink = NAN;
  EXPECT_THROW(fit_kdtree(examples, settings), ConfigError);
}

TEST(FitGrid, LowersTheVarianceOfASeparableFunction) {
  for (const int dims : {1, 2, 4}) {
    const TestIntegrand integrand = bump(dims);
    const auto grid = fit_grid(examples_of(integrand, 200'000), {});
    EXPECT_LT(second_moment(integrand, *grid) - 1, 0.04 * dims);
  }
}

TEST(FitGrid, StaysWellFormedWhereAllLightIsInAPoint) {
  const TestIntegrand point(2, 1, [](auto y, auto f) { f[0] = std::fabs(y[0] - 0.3) < 1e-4; });
  GridSettings settings;
  settings.alpha = 2;
  settings.iterations = 50;
  const auto grid = fit_grid(examples_of(point, 50'000), settings);
  CheckOptions options;
  options.log_det_tolerance = 1e-2;  // where y hardly moves, its differences have few digits
  EXPECT_EQ(check_warp(*grid, options), "");
}

TEST(FitGrid, IsTheSameForAnyNumberOfThreads) {
  const Examples examples = examples_of(bump(4), 50'000);
  const auto with_threads = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return fit_grid(examples, {})->edges().values();
  };
  EXPECT_EQ(with_threads(1), with_threads(2));
}

TEST(FitGrid, HalvedIsTheSameMapAndFollowsMoreClosely) {
  const auto coarse = fit_grid(examples_of(bump(2), 200'000), {});
  const Grid fine = halved(*coarse);
  ASSERT_EQ(fine.bins(), 2 * coarse->bins());
  Matrix<double> z(1000, 2), of_coarse(1000, 2), of_fine(1000, 2);
  for (std::size_t k = 0; k < z.values().size(); ++k) z.values()[k] = sample_double(5, static_cast<std::uint32_t>(k));
  std::vector<double> log_coarse(1000), log_fine(1000);
  coarse->forward(z.batch(), of_coarse.batch(), log_coarse);
  fine.forward(z.batch(), of_fine.batch(), log_fine);
  for (std::size_t k = 0; k < z.values().size(); ++k)
    EXPECT_NEAR(of_fine.values()[k], of_coarse.values()[k], 1e-12) << k;
  for (std::size_t k = 0; k < 1000; ++k) EXPECT_NEAR(log_fine[k], log_coarse[k], 1e-9) << k;
  const auto finer = fit_grid(examples_of(bump(2), 200'000), {}, &fine);
  EXPECT_LT(second_moment(bump(2), *finer) - 1, 0.5 * (second_moment(bump(2), *coarse) - 1));
}

TEST(FitGrid, CanStartFromAMap) {
  const Examples examples = examples_of(bump(2), 50'000);
  GridSettings settings;
  settings.iterations = 3;
  const auto first = fit_grid(examples, settings);
  const double further = second_moment(bump(2), *fit_grid(examples, settings, first.get()));
  EXPECT_LT(further, second_moment(bump(2), *first));
}

}  // namespace
}  // namespace warpath
