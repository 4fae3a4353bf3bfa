#include "warpath/integrator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>

#include "integrand/test_functions.h"
#include "warpath/error.h"

namespace warpath {
namespace {

std::vector<Interval> unit(int dims) { return std::vector<Interval>(static_cast<std::size_t>(dims)); }

Integrator::Function function(const TestFunction& test) {
  return [&test](Batch<const double> x, Batch<double> f) {
    const std::vector<std::uint64_t> ids(x.rows());
    test.evaluate(x, ids, f);
  };
}

/// Standard deviation of a point's weight, relative to the mean, as the error says.
double spread(const Integral& result) {
  return result.sdev() * std::sqrt(static_cast<double>(result.neval())) / std::abs(result.mean());
}

Integral adapt_and_measure(const TestFunction& test, IntegratorSettings settings, std::size_t neval = 20'000) {
  Integrator integrator(unit(test.dims()), std::move(settings));
  integrator.integrate(function(test), {.nitn = 6, .neval = neval});
  return integrator.integrate(function(test), {.nitn = 4, .neval = neval, .adapt = false});
}

struct Case {
  const char* warp;
  const char* sampler;
};

class EveryWarp : public testing::TestWithParam<Case> {};

// Whatever was learned, what it draws is unbiased. The mean of 400 iterations is within 5 standard errors (6e-7); the
// squares of their pulls have a mean near 1: above it, for errors from 16 or more replicates, by 15 %, and a standard
// deviation of less than 0.12, of which 5 are allowed (1e-6).
TEST_P(EveryWarp, PullsAreStandardNormal) {
  const auto test = make_test_function("camel", 2);
  IntegratorSettings settings{.warp = GetParam().warp};
  settings.sampler = GetParam().sampler;
  Integrator integrator(unit(2), settings);
  integrator.integrate(function(*test), {.nitn = 4, .neval = 4000});
  const Integral all = integrator.integrate(function(*test), {.nitn = 400, .neval = 1000, .adapt = false});
  double square = 0;
  for (const Iteration& i : all.iterations()) {
    const double pull = (i.mean[0] - test->exact()) / i.sdev();
    square += pull * pull / 400;
  }
  EXPECT_NEAR(all.mean(), test->exact(), 5 * all.sdev());
  EXPECT_NEAR(square, 1.08, 0.65);
}

INSTANTIATE_TEST_SUITE_P(Families, EveryWarp,
                         testing::Values(Case{"uniform", "independent"}, Case{"uniform", "sobol"},
                                         Case{"grid", "sobol"}, Case{"kdtree", "sobol"}, Case{"realnvp", "independent"},
                                         Case{"spline", "sobol"}, Case{"auto", "independent"}, Case{"auto", "sobol"}),
                         [](const auto& test) { return fmt::format("{}_{}", test.param.warp, test.param.sampler); });

TEST(Integrator, FindsBothPeaksInSixteenDimensions) {
  const auto test = make_test_function("camel", 16);
  const Integral result = adapt_and_measure(*test, {}, 50'000);
  // With one peak alone the result would be half. A uniform point has a spread of about 104.
  EXPECT_NEAR(result.mean(), test->exact(), 6 * result.sdev());
  EXPECT_LT(spread(result), 10);
  EXPECT_GT(result.Q(), 1e-6);
}

TEST(Integrator, AGridIsEnoughForAProduct) {
  const auto test = make_test_function("gauss", 8);
  Integrator integrator(unit(8));
  integrator.integrate(function(*test), {.nitn = 6, .neval = 50'000});
  const Integral result = integrator.integrate(function(*test), {.nitn = 4, .neval = 50'000, .adapt = false});
  EXPECT_LT(spread(result), 0.2);
  EXPECT_NEAR(result.mean(), test->exact(), 6 * result.sdev());
}

TEST(Integrator, TheSameForAnyNumberOfThreads) {
  const auto test = make_test_function("camel", 4);
  const auto with_threads = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const Integral result = adapt_and_measure(*test, {});
    return std::pair(result.mean(), result.sdev());
  };
  EXPECT_EQ(with_threads(1), with_threads(2));
}

// x^2 y over [0, 2] x [-1, 3], and 1: the volume; both at once.
TEST(Integrator, SeveralIntegralsOverABox) {
  Integrator integrator({{0, 2}, {-1, 3}});
  const auto f = [](Batch<const double> x, Batch<double> values) {
    for (std::size_t i = 0; i < x.rows(); ++i) {
      values(i, 0) = x(i, 0) * x(i, 0) * x(i, 1);
      values(i, 1) = 1;
    }
  };
  const Integral result = integrator.integrate(f, {.nitn = 5, .neval = 10'000, .adapt = true, .integrals = 2});
  ASSERT_EQ(result.count(), 2u);
  EXPECT_NEAR(result.mean(0), 8.0 / 3 * 4, 6 * result.sdev(0));
  EXPECT_NEAR(result.mean(1), 8, 6 * result.sdev(1) + 1e-12);
  EXPECT_TRUE(result.converged(1e-2, 0));
  EXPECT_FALSE(result.converged(0, 0));
}

TEST(Integrator, ASampleIsWeighedByItsDensity) {
  const auto test = make_test_function("camel", 2);
  Integrator integrator({{0, 1}, {0, 1}});
  integrator.integrate(function(*test), {.nitn = 6, .neval = 20'000});
  constexpr std::size_t kCount = 5000;
  Matrix<double> x(kCount, 2), f(kCount, 1);
  std::vector<double> weight(kCount), again(kCount);
  integrator.sample(x.batch(), weight);
  integrator.weights(x.batch(), again);
  double volume = 0, square = 0;
  for (std::size_t i = 0; i < kCount; ++i) {
    // The shares of the two components differ a little between short and long sequences.
    EXPECT_NEAR(weight[i] / again[i], 1, 0.05);
    volume += weight[i] / kCount;
    square += weight[i] * weight[i] / kCount;
  }
  // The mean weight is the volume, 1.
  EXPECT_NEAR(volume, 1, 6 * std::sqrt(square / kCount));
}

TEST(Integrator, AValueThatIsNotFiniteIsZeroAndCounted) {
  Integrator integrator(unit(1), {.warp = "uniform"});
  const auto f = [](Batch<const double> x, Batch<double> values) {
    for (std::size_t i = 0; i < x.rows(); ++i) values(i, 0) = x(i, 0) < 0.5 ? NAN : 1;
  };
  const Integral result = integrator.integrate(f, {.nitn = 2, .neval = 1024, .adapt = true});
  EXPECT_EQ(result.non_finite(), 1024u) << "each half of a scrambled sequence has half of the points";
  EXPECT_NEAR(result.mean(), 0.5, 1e-12);
}

TEST(Integrator, WhatIsSavedIsGoneOnWith) {
  const auto test = make_test_function("camel", 4);
  const auto path = std::filesystem::path(testing::TempDir()) / "camel.warp";
  Integrator integrator({{0, 1}, {0, 1}, {0, 1}, {0, 1}});
  integrator.integrate(function(*test), {.nitn = 6, .neval = 20'000});
  integrator.save(path);
  Integrator loaded = Integrator::load(path);
  EXPECT_EQ(loaded.warp(), integrator.warp());
  const Integral result = loaded.integrate(function(*test), {.nitn = 4, .neval = 20'000, .adapt = false});
  EXPECT_NEAR(result.mean(), test->exact(), 6 * result.sdev());
  EXPECT_LT(spread(result), 0.5);
  EXPECT_THROW(Integrator::load(path, {.warp = "kdtree"}), ConfigError);
  std::filesystem::remove(path);
  EXPECT_THROW(Integrator::load(path), FileError);
}

TEST(Integrator, BadUsageIsAClearError) {
  const auto message = [](auto&& action) {
    try {
      action();
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(message([] { Integrator({{1, 0}}); }), testing::HasSubstr("bounds 1 to 0"));
  EXPECT_THAT(message([] { Integrator({}); }), testing::HasSubstr("0 dimensions"));
  EXPECT_THAT(message([] { Integrator(unit(33), {.warp = "spline"}); }), testing::HasSubstr("33 dimensions"));
  EXPECT_THAT(message([] { Integrator(unit(2), {.warp = "vegas"}); }), testing::HasSubstr("unknown warp \"vegas\""));
  EXPECT_THAT(message([] { Integrator(unit(2)).begin(3); }), testing::HasSubstr("neval is 3"));
}

TEST(Integral, ValuesArePrintedWithTheirErrors) {
  EXPECT_EQ(with_error(1.00573, 0.00642), "1.0057(64)");
  EXPECT_EQ(with_error(-1.00573, 0.00996), "-1.006(10)") << "99.6 rounds up to one place more";
  EXPECT_EQ(with_error(123.4, 2.5), "123.4(2.5)");
  EXPECT_EQ(with_error(1234, 25), "1234(25)");
  EXPECT_EQ(with_error(0.000012345, 0.00000067), "1.234(67)e-05");
  EXPECT_EQ(with_error(2, 0), "2(0)");
}

// Two iterations 0 and 2 with variances 1: mean 1, chi2 = 2, Q = P(chi2_1 > 2) = erfc(1).
TEST(Integral, CombinesIterationsOfAFixedWarpByTheirPoints) {
  const auto iteration = [](double mean, double variance, std::uint64_t neval) {
    Iteration result;
    result.mean = {mean};
    result.covariance = {variance};
    result.neval = neval;
    return result;
  };
  const Integral equal({iteration(0, 1, 100), iteration(2, 1, 100)});
  EXPECT_DOUBLE_EQ(equal.mean(), 1);
  EXPECT_DOUBLE_EQ(equal.sdev(), std::sqrt(0.5));
  EXPECT_DOUBLE_EQ(equal.chi2(), 2);
  EXPECT_EQ(equal.dof(), 1);
  EXPECT_NEAR(equal.Q(), std::erfc(1.0), 1e-12);
  const Integral more({iteration(0, 1, 300), iteration(2, 3, 100)});
  EXPECT_DOUBLE_EQ(more.mean(), 0.5);
  // After adaptation by the inverse variance.
  Iteration first = iteration(0, 1, 100);
  first.adapted = true;
  EXPECT_DOUBLE_EQ(Integral({first, iteration(2, 0.25, 100)}).mean(), 1.6);
}

}  // namespace
}  // namespace warpath
