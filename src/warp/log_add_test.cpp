#include "warp/log_add.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/rng.h"
#include "nn/simd.h"

namespace warpath {
namespace {

constexpr double kNone = -std::numeric_limits<double>::infinity();

TEST(LogAdd, IsTheLogarithmOfTheSum) {
  for (const std::string& target : nn::simd_targets()) {
    const nn::ForceSimdTarget forced(target);
    for (const std::size_t n : {1u, 7u, 8u, 61u}) {
      std::vector<double> a, b;
      for (std::uint32_t i = 0; i < n; ++i) {
        a.push_back(40 * sample_double(1, i) - 20);
        b.push_back(40 * sample_double(2, i) - 20);
      }
      std::vector<double> sum = a;
      log_add(n, sum.data(), b.data(), -0.5);
      for (std::size_t i = 0; i < n; ++i)
        EXPECT_NEAR(sum[i], std::log(std::exp(a[i]) + std::exp(b[i] - 0.5)), 1e-14 * (1 + std::abs(sum[i]))) << target;
    }
  }
}

TEST(LogAdd, OfExtremes) {
  std::vector<double> a{kNone, 3, kNone, 700, -700, 1e6, 0}, b{2, kNone, kNone, -700, 700, 1e6, -1e9};
  const std::vector<double> expected{2, 3, kNone, 700, 700, 1e6 + std::log(2.0), 0};
  log_add(a.size(), a.data(), b.data(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_DOUBLE_EQ(a[i], expected[i]) << i;
}

TEST(LogAdd, ARowDoesNotDependOnItsPlace) {
  std::vector<double> a, b;
  for (std::uint32_t i = 0; i < 64; ++i) {
    a.push_back(10 * sample_double(1, i) - 5);
    b.push_back(10 * sample_double(2, i) - 5);
  }
  std::vector<double> all = a;
  log_add(all.size(), all.data(), b.data(), 0.1);
  for (std::size_t i = 0; i < a.size(); ++i) {
    log_add(1, &a[i], &b[i], 0.1);
    EXPECT_EQ(a[i], all[i]);
  }
}

}  // namespace
}  // namespace warpath
