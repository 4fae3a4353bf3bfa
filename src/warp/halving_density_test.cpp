#include "warp/halving_density.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/rng.h"

namespace warpath {
namespace {

struct Case {
  std::array<int, 3> bits;
  int parts;
};
const std::vector<Case> kCases{{{0, 4, 4}, 1}, {{2, 3, 3}, 0}, {{4, 2, 2}, 0}, {{2, 2, 2}, 3}, {{7, 1, 1}, 93}};

/// Masses that differ by orders of magnitude, some of them 0.
std::vector<float> masses(const HalvingGrid& grid) {
  std::vector<float> m(grid.bins());
  for (std::uint32_t b = 0; b < grid.bins(); ++b) {
    const float r = sample_float(7, b);
    m[b] = grid.volume(b) > 0 && r > 0.2f ? std::exp(8 * r) : 0;
  }
  return m;
}

TEST(HalvingGrid, VolumesAddUpToOne) {
  for (const auto& [bits, parts] : kCases) {
    const HalvingGrid grid(bits, parts);
    double sum = 0;
    for (std::uint32_t b = 0; b < grid.bins(); ++b) sum += grid.volume(b);
    EXPECT_NEAR(sum, 1, 1e-6);
  }
}

TEST(HalvingGrid, PartsOfTheFirstNumberAreWholeBins) {
  const HalvingGrid grid({2, 1, 1}, 3);
  for (const float u : {0.0f, 0.2f, 0.9f}) {
    EXPECT_EQ(grid.bin(0.33f, u, 0), grid.bin(0.01f, u, 0));
    EXPECT_NE(grid.bin(0.34f, u, 0), grid.bin(0.33f, u, 0));
    EXPECT_EQ(grid.bin(0.99f, u, 0), grid.bin(0.67f, u, 0));
  }
}

TEST(HalvingGrid, DensityFollowsTheMasses) {
  for (const auto& [bits, parts] : kCases) {
    const HalvingGrid grid(bits, parts);
    const std::vector<float> mass = masses(grid);
    std::vector<CumulativeProbability> density(grid.stored());
    grid.set_density(mass, density.data());
    double total = 0, whole = 0, apart = 0;
    for (const float m : mass) total += m;
    for (std::uint32_t b = 0; b < grid.bins(); ++b) {
      const double probability = grid.volume(b) / grid.inverse_density(density.data(), b);
      EXPECT_EQ(probability > 0, mass[b] > 0);
      whole += probability;
      apart += std::fabs(probability - mass[b] / total) / 2;
    }
    EXPECT_NEAR(whole, 1, 1e-5);
    // A node gives up to 16 of its 240 units away evenly, and there are two or three on the way to a bin.
    EXPECT_LT(apart, 0.1);
  }
}

TEST(HalvingGrid, SamplesFallWhereTheDensitySaysAndTellIt) {
  constexpr int kSamples = 1 << 18;
  for (const auto& [bits, parts] : kCases) {
    const HalvingGrid grid(bits, parts);
    const std::vector<float> mass = masses(grid);
    std::vector<CumulativeProbability> density(grid.stored());
    grid.set_density(mass, density.data());
    std::vector<int> hits(grid.bins());
    for (int i = 0; i < kSamples; ++i) {
      const std::uint64_t key = sample_key(3, static_cast<std::uint64_t>(i));
      std::array<float, 3> y;
      const float inv_q =
          grid.sample(density.data(), {sample_double(key, 0), sample_double(key, 1), sample_double(key, 2)}, y);
      for (const float value : y) ASSERT_TRUE(value >= 0 && value < 1);
      const std::uint32_t bin = grid.bin(y[0], y[1], y[2]);
      ASSERT_GT(mass[bin], 0);
      ++hits[bin];
      ASSERT_NEAR(grid.inverse_density(density.data(), bin) / inv_q, 1, 1e-4);
    }
    double chi2 = 0, dof = -1;
    for (std::uint32_t b = 0; b < grid.bins(); ++b) {
      const double expected = kSamples * grid.volume(b) / grid.inverse_density(density.data(), b);
      if (expected < 5) continue;
      chi2 += (hits[b] - expected) * (hits[b] - expected) / expected;
      dof += 1;
    }
    // 5 standard deviations of a chi-squared variable, near normal for so many bins: one false alarm in 10^6.
    EXPECT_LT(chi2, dof + 5 * std::sqrt(2 * dof));
  }
}

TEST(HalvingGrid, SamplesAreUniformWithinABin) {
  // What is left of a latent places the sample: in each number of the largest bin, halves are hit equally often.
  constexpr int kSamples = 1 << 16;
  for (const auto& [bits, parts] : kCases) {
    const HalvingGrid grid(bits, parts);
    std::vector<float> mass(grid.bins(), 0.0f);
    mass[0] = 1;
    std::vector<CumulativeProbability> density(grid.stored());
    grid.set_density(mass, density.data());
    const double scale[3] = {parts > 0 ? double(parts) : double(1 << bits[0]), double(1 << bits[1]),
                             double(1 << bits[2])};
    std::array<int, 3> upper{};
    for (int i = 0; i < kSamples; ++i) {
      const std::uint64_t key = sample_key(4, static_cast<std::uint64_t>(i));
      std::array<float, 3> y;
      grid.sample(density.data(), {sample_double(key, 0), sample_double(key, 1), sample_double(key, 2)}, y);
      for (std::size_t a = 0; a < 3; ++a) upper[a] += y[a] * scale[a] >= 0.5;
    }
    // 5 standard deviations of a binomial variable; 15 of them: one false alarm in 10^5.
    for (const int n : upper) EXPECT_NEAR(n, kSamples / 2, 5 * std::sqrt(kSamples / 4.0));
  }
}

TEST(HalvingGrid, LatentsAtTheEdgesStayInside) {
  const HalvingGrid grid({2, 3, 3});
  std::vector<float> mass(grid.bins());
  std::vector<CumulativeProbability> density(grid.stored());
  mass[grid.bins() - 1] = 1;  // all in the last bin
  grid.set_density(mass, density.data());
  constexpr double kAlmostOne = 0x1.fffffffffffffp-1;
  for (const double z : {0.0, 0.5, kAlmostOne}) {
    std::array<float, 3> y;
    EXPECT_NEAR(grid.sample(density.data(), {z, z, z}, y), 1.0 / grid.bins(), 1e-9);
    EXPECT_EQ(grid.bin(y[0], y[1], y[2]), grid.bins() - 1);
  }
}

TEST(HalvingGrid, UniformMassesAreNearlyUniform) {
  for (const auto& [bits, parts] : kCases) {
    const HalvingGrid grid(bits, parts);
    std::vector<float> mass;
    std::vector<CumulativeProbability> density(grid.stored());
    for (std::uint32_t b = 0; b < grid.bins(); ++b) mass.push_back(grid.volume(b));
    grid.set_density(mass, density.data());
    // Equal children get whole units; parts that do not fill their nodes are rounded.
    for (std::uint32_t b = 0; b < grid.bins(); ++b)
      if (grid.volume(b) > 0) {
        EXPECT_NEAR(grid.inverse_density(density.data(), b), 1, parts > 1 ? 0.15 : 1e-6);
      }
  }
}

TEST(HalvingGrid, KnowsADensityFromOtherNumbers) {
  for (const auto& [bits, parts] : kCases) {
    const HalvingGrid grid(bits, parts);
    std::vector<CumulativeProbability> density(grid.stored());
    grid.set_density(masses(grid), density.data());
    EXPECT_TRUE(grid.is_density(density));
    EXPECT_FALSE(grid.is_density(std::span(density).first(density.size() - 1)));
    auto broken = density;
    broken[15] -= 1;  // not whole
    EXPECT_FALSE(grid.is_density(broken));
    broken = density;
    broken[3] = static_cast<CumulativeProbability>(broken[4] + 1);  // falls
    EXPECT_FALSE(grid.is_density(broken));
  }
  const HalvingGrid grid({2, 0, 0}, 3);  // the fourth child does not exist
  std::vector<CumulativeProbability> numbers(grid.stored(), static_cast<CumulativeProbability>(kWholeProbability));
  numbers[0] = 50, numbers[1] = 100;
  EXPECT_TRUE(grid.is_density(numbers));
  numbers[2] = 150;
  EXPECT_FALSE(grid.is_density(numbers));
}

}  // namespace
}  // namespace warpath
