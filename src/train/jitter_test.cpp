#include "train/jitter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace warpath {
namespace {

constexpr std::uint64_t kSeed = 7, kCount = 100'000;

// Means and variances of three dimensions, and one covariance, each within 4.5 standard errors: false alarm 5e-5.
TEST(Jitter, IsAGaussianOfTheWidthInEachDimension) {
  constexpr double kWidth = 0.01;
  double sum[3] = {}, squares[3] = {}, product = 0;
  for (std::uint64_t k = 0; k < kCount; ++k) {
    std::vector<float> y(3, 0.5f);
    jitter(y, kWidth, kSeed, k);
    double moved[3];
    for (int d = 0; d < 3; ++d) {
      moved[d] = (static_cast<double>(y[d]) - 0.5) / kWidth;
      sum[d] += moved[d];
      squares[d] += moved[d] * moved[d];
    }
    product += moved[0] * moved[1];
  }
  const double root = std::sqrt(static_cast<double>(kCount));
  for (int d = 0; d < 3; ++d) {
    EXPECT_LT(std::abs(sum[d]), 4.5 * root);
    EXPECT_LT(std::abs(squares[d] - kCount), 4.5 * std::sqrt(2.0) * root);
  }
  EXPECT_LT(std::abs(product), 4.5 * root);
}

// Uniform samples stay uniform, as no mass leaves at the borders: ten bins within 4.5 standard errors, false alarm
// 7e-5.
TEST(Jitter, KeepsUniformSamplesUniform) {
  std::vector<double> bins(10);
  for (std::uint64_t k = 0; k < kCount; ++k) {
    std::vector<float> y{(static_cast<float>(k) + 0.5f) / kCount};
    jitter(y, 0.3, kSeed, k);
    ASSERT_TRUE(y[0] >= 0 && y[0] < 1);
    ++bins[static_cast<std::size_t>(10 * y[0])];
  }
  for (const double n : bins) EXPECT_LT(std::abs(n - kCount / 10), 4.5 * std::sqrt(kCount * 0.1 * 0.9));
}

TEST(Jitter, IsAFunctionOfSeedAndNumber) {
  std::vector<float> a{0.2f, 0.9f}, b = a, c = a;
  jitter(a, 0.1, kSeed, 3);
  jitter(b, 0.1, kSeed, 3);
  jitter(c, 0.1, kSeed, 4);
  EXPECT_EQ(a, b);
  EXPECT_NE(a, c);
}

}  // namespace
}  // namespace warpath
