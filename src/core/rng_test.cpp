#include "core/rng.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <functional>
#include <set>
#include <vector>

namespace warpath {
namespace {

constexpr double kFalseAlarm = 1e-6;  // of every chi^2 test here; all of them have fixed seeds

/// Chance of a chi^2 at least as large as that of `counts` against equal expectations.
double chance(const std::vector<double>& counts) {
  double sum = 0, chi2 = 0;
  for (const double count : counts) sum += count;
  const double expected = sum / static_cast<double>(counts.size());
  for (const double count : counts) chi2 += (count - expected) * (count - expected) / expected;
  return boost::math::gamma_q(0.5 * static_cast<double>(counts.size() - 1), 0.5 * chi2);
}

/// Histogram of 2^18 pairs of numbers on 32 x 32 cells.
double chance_of_pairs(const std::function<std::pair<double, double>(std::uint64_t)>& pair) {
  std::vector<double> counts(32 * 32);
  for (std::uint64_t i = 0; i < (1 << 18); ++i) {
    const auto [a, b] = pair(i);
    ++counts[static_cast<std::size_t>(a * 32) * 32 + static_cast<std::size_t>(b * 32)];
  }
  return chance(counts);
}

TEST(Rng, NumbersAreUniform) {
  for (const std::uint64_t seed : {0u, 1u, 12345u}) {
    std::vector<double> over_ids(1000), over_dimensions(1000);
    for (std::uint32_t i = 0; i < 1'000'000; ++i) {
      ++over_ids[static_cast<std::size_t>(sample_double(sample_key(seed, i), 3) * 1000)];
      ++over_dimensions[static_cast<std::size_t>(sample_double(sample_key(seed, 7), i) * 1000)];
    }
    EXPECT_GT(chance(over_ids), kFalseAlarm) << "seed " << seed;
    EXPECT_GT(chance(over_dimensions), kFalseAlarm) << "seed " << seed;
  }
}

TEST(Rng, NeighboursAreIndependent) {
  const auto number = [](std::uint64_t seed, std::uint64_t id, std::uint32_t d) {
    return sample_double(sample_key(seed, id), d);
  };
  for (const std::uint32_t d : {0u, 4u, 39u})
    EXPECT_GT(chance_of_pairs([&](auto i) { return std::pair(number(1, i, d), number(1, i, d + 1)); }), kFalseAlarm)
        << d;
  EXPECT_GT(chance_of_pairs([&](auto i) { return std::pair(number(1, i, 0), number(1, i + 1, 0)); }), kFalseAlarm);
  EXPECT_GT(chance_of_pairs([&](auto i) { return std::pair(number(i, 5, 0), number(i + 1, 5, 0)); }), kFalseAlarm);
  EXPECT_GT(chance_of_pairs([&](auto i) { return std::pair(number(i, 5, 0), number(5, i, 0)); }), kFalseAlarm);
  // Candidates and samples: ids that differ in their top bit.
  EXPECT_GT(chance_of_pairs([&](auto i) { return std::pair(number(1, i, 0), number(1, i + (1ull << 63), 0)); }),
            kFalseAlarm);
}

TEST(Rng, LowBitsAreAsGoodAsHighOnes) {
  std::vector<double> counts(256);
  for (std::uint64_t i = 0; i < (1 << 18); ++i) ++counts[sample_bits(sample_key(2, i), 0) & 255];
  EXPECT_GT(chance(counts), kFalseAlarm);
}

TEST(Rng, EveryInputBitFlipsHalfOfTheOutput) {
  // Over 4096 keys the mean of flipped bits has a standard deviation of 4 / 64.
  const auto mean_flips = [](const std::function<std::uint64_t(std::uint64_t)>& f, int bit) {
    double flips = 0;
    for (std::uint64_t i = 0; i < 4096; ++i) flips += std::popcount(f(i) ^ f(i ^ (1ull << bit)));
    return flips / 4096;
  };
  for (int bit = 0; bit < 64; ++bit) {
    EXPECT_NEAR(mean_flips([](auto i) { return sample_bits(sample_key(1, i), 0); }, bit), 32, 6 * 4 / 64.0) << bit;
    EXPECT_NEAR(mean_flips([](auto i) { return sample_bits(sample_key(i, 1), 0); }, bit), 32, 6 * 4 / 64.0) << bit;
  }
}

TEST(Rng, KeysDoNotCollide) {
  std::set<std::uint64_t> keys;
  for (std::uint64_t seed = 0; seed < 300; ++seed)
    for (std::uint64_t id = 0; id < 300; ++id) keys.insert(sample_key(seed, id));
  EXPECT_EQ(keys.size(), 90'000u);
}

TEST(Rng, MixIsABijection) {
  // Undoes each step: multiplication by the inverse of an odd number, and x ^= x >> s.
  const auto inverse = [](std::uint64_t odd) {
    std::uint64_t x = odd;
    for (int i = 0; i < 6; ++i) x *= 2 - odd * x;
    return x;
  };
  const auto unshift = [](std::uint64_t x, int s) {
    std::uint64_t result = x;
    for (int i = 0; i < 64 / s; ++i) result = x ^ (result >> s);
    return result;
  };
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const std::uint64_t x = i * 0x9e3779b97f4a7c15u;
    std::uint64_t y = unshift(mix64(x), 31);
    y = unshift(y * inverse(0x94d049bb133111ebu), 27);
    EXPECT_EQ(unshift(y * inverse(0xbf58476d1ce4e5b9u), 30), x);
  }
}

TEST(Rng, UnitNumbersStayBelowOne) {
  for (const std::uint64_t bits : {std::uint64_t{0}, ~std::uint64_t{0}, std::uint64_t{1} << 63}) {
    EXPECT_GE(to_unit_float(bits), 0.0f);
    EXPECT_LT(to_unit_float(bits), 1.0f);
    EXPECT_GE(to_unit_double(bits), 0.0);
    EXPECT_LT(to_unit_double(bits), 1.0);
  }
  EXPECT_EQ(to_unit_float(0), 0.0f);
  EXPECT_EQ(to_unit_double(std::uint64_t{1} << 63), 0.5);
}

TEST(Rng, FloatAndDoubleAreOneNumber) {
  for (std::uint64_t i = 0; i < 10'000; ++i) {
    const std::uint64_t bits = sample_bits(sample_key(1, i), 0);
    const double difference = to_unit_double(bits) - to_unit_float(bits);
    EXPECT_GE(difference, 0);
    EXPECT_LT(difference, 0x1p-24);
  }
}

TEST(Rng, PrimarySamplesAreTheNearestFloatsBelowOne) {
  EXPECT_EQ(to_primary(0), 0.0f);
  EXPECT_EQ(to_primary(1 - 0x1p-53), 0x1.fffffep-1f);
  EXPECT_EQ(to_primary(1.0), 0x1.fffffep-1f);
  EXPECT_EQ(to_primary(-1e-20), 0.0f);
  for (std::uint64_t i = 0; i < 10'000; ++i) {
    const double y = sample_double(sample_key(1, i), 0);
    EXPECT_LE(std::fabs(to_primary(y) - y), 0x1p-24);
    EXPECT_EQ(to_primary(static_cast<double>(sample_float(sample_key(1, i), 0))), sample_float(sample_key(1, i), 0));
  }
}

}  // namespace
}  // namespace warpath
