#include "integrand/test_functions.h"

#include <gtest/gtest.h>

#include <numeric>

#include "core/rng.h"
#include "warpath/error.h"

namespace warpath {
namespace {

// Plain Monte Carlo in dimensions where it still sees the peaks; each z-test fails by chance once in 150,000 runs.
TEST(TestFunctions, MonteCarloMeetsTheExactIntegral) {
  struct Case {
    const char* name;
    int dims;
  };
  for (const Case c : {Case{"gauss", 1},
                       {"gauss", 2},
                       {"gauss", 4},
                       {"camel", 2},
                       {"camel", 4},
                       {"circles", 2},
                       {"polynomial", 3},
                       {"polynomial", 18}}) {
    const auto f = make_test_function(c.name, c.dims);
    ASSERT_EQ(f->dims(), c.dims);
    const std::size_t n = 200000, d = static_cast<std::size_t>(c.dims);
    Matrix<double> y(n, d), value(n, 1);
    std::vector<std::uint64_t> ids(n);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < d; ++k) y(i, k) = sample_double(sample_key(7, i), static_cast<std::uint32_t>(k));
    f->evaluate(y.batch(), ids, value.batch());
    double sum = 0, squares = 0;
    for (const double v : value.values()) sum += v, squares += v * v;
    const double mean = sum / n, error = std::sqrt((squares / n - mean * mean) / n);
    EXPECT_NEAR(mean, f->exact(), 4.5 * error) << c.name << " in " << c.dims << " dimensions";
  }
}

TEST(TestFunctions, CirclesByQuadrature) {
  const auto f = make_test_function("circles", 2);
  const std::size_t n = 2000;
  Matrix<double> y(n, 2), value(n, 1);
  std::vector<std::uint64_t> ids(n);
  double sum = 0;
  for (std::size_t row = 0; row < n; ++row) {
    for (std::size_t i = 0; i < n; ++i) y(i, 0) = (i + 0.5) / n, y(i, 1) = (row + 0.5) / n;
    f->evaluate(y.batch(), ids, value.batch());
    sum = std::accumulate(value.values().begin(), value.values().end(), sum);
  }
  EXPECT_NEAR(sum / (n * n), f->exact(), 1e-6);
}

TEST(TestFunctions, UnknownNameAndWrongDimensionsAreErrors) {
  EXPECT_THROW(make_test_function("gaus", 2), ConfigError);
  EXPECT_THROW(make_test_function("circles", 3), ConfigError);
  EXPECT_THROW(make_test_function("gauss", 0), ConfigError);
}

}  // namespace
}  // namespace warpath
