#include "estimate/allocation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/rng.h"

namespace warpath {
namespace {

constexpr int kWidth = 40, kHeight = 20, kPixels = kWidth * kHeight;

/// Left half: mean 1, standard deviation 1; right half: mean 0.1, standard deviation 0.2.
PixelMoments two_halves() {
  PixelMoments moments(kWidth, kHeight);
  for (std::uint32_t p = 0; p < kPixels; ++p)
    for (std::uint32_t s = 0; s < 64; ++s) {
      const bool plus = s % 2;
      const float value = p % kWidth < kWidth / 2 ? (plus ? 2.0f : 0.0f) : (plus ? 0.3f : -0.1f);
      moments.add(p, Color(value, value, value));
    }
  return moments;
}

double mean_count(const std::vector<std::uint32_t>& counts, int x0, int x1) {
  double sum = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = x0; x < x1; ++x) sum += counts[static_cast<std::size_t>(y * kWidth + x)];
  return sum / (kHeight * (x1 - x0));
}

TEST(Allocation, SpendsWhatItHasAndForgetsNoPixel) {
  const PixelMoments moments = two_halves();
  for (const int spp : {1, 2, 5, 64})
    for (const auto objective : {Objective::mse, Objective::relmse})
      for (const double u : {0.0, 0.3, 0.999}) {
        const auto counts = moments.allocate(spp, objective, u);
        EXPECT_GE(*std::min_element(counts.begin(), counts.end()), 1u);
        EXPECT_NEAR(std::accumulate(counts.begin(), counts.end(), 0.0), spp * kPixels, 1.01);
      }
}

TEST(Allocation, FollowsTheStandardDeviationOverWhatTheErrorDividesBy) {
  const PixelMoments moments = two_halves();
  constexpr int kSpp = 101;
  // Away from the middle, where the pools of both halves mix. A quarter of the samples is spread evenly.
  const auto ratio = [&](Objective objective) {
    const auto counts = moments.allocate(kSpp, objective, 0.5);
    const double even = 1 + 0.25 * (kSpp - 1);
    return (mean_count(counts, 0, 16) - even) / (mean_count(counts, 24, kWidth) - even);
  };
  EXPECT_NEAR(ratio(Objective::mse), 1.0 / 0.2, 0.1);
  const double left = 1 / std::sqrt(1 + 0.01), right = 0.2 / std::sqrt(0.01 + 0.01);
  EXPECT_NEAR(ratio(Objective::relmse), left / right, 0.02);
}

TEST(Allocation, IsEvenWhereNothingIsKnown) {
  const PixelMoments nothing(kWidth, kHeight);
  for (const std::uint32_t n : nothing.allocate(7, Objective::mse, 0.5)) EXPECT_EQ(n, 7u);
  PixelMoments constant(kWidth, kHeight);
  for (std::uint32_t p = 0; p < kPixels; ++p)
    for (int s = 0; s < 4; ++s) constant.add(p, Color(1, 1, 1));
  for (const std::uint32_t n : constant.allocate(7, Objective::relmse, 0.5)) EXPECT_EQ(n, 7u);
}

TEST(Allocation, NonFiniteSamplesCountAsBlack) {
  PixelMoments moments(kWidth, kHeight);
  for (std::uint32_t p = 0; p < kPixels; ++p) {
    moments.add(p, Color(NAN, 0, 0));
    moments.add(p, Color(1, 1, 1));
  }
  for (const std::uint32_t n : moments.allocate(3, Objective::mse, 0.5)) EXPECT_EQ(n, 3u);
}

}  // namespace
}  // namespace warpath
