#include "core/sobol.h"

#include <gtest/gtest.h>

#include <boost/random/sobol.hpp>
#include <cmath>
#include <set>
#include <vector>

namespace warpath {
namespace {

TEST(Sobol, AgreesWithBoostsEngine) {
  // Boost walks the points in Gray-code order and leaves out the origin.
  boost::random::sobol_engine<std::uint32_t, 32> engine(kSobolDimensions);
  for (std::uint32_t i = 1; i < 300; ++i) {
    const std::uint32_t gray = i ^ (i >> 1);
    for (int d = 0; d < kSobolDimensions; ++d) ASSERT_EQ(sobol_bits(gray, d), engine()) << i << " " << d;
  }
}

TEST(Sobol, ScrambledRunsOfAPowerOfTwoAreStratifiedInEveryDimension) {
  constexpr std::uint32_t kCount = 256;
  for (const std::uint32_t seed : {1u, 77u, 0xdeadbeefu})
    for (const std::uint32_t first : {0u, 256u, 1280u})
      for (int d = 0; d < kSobolDimensions; ++d) {
        std::set<std::uint32_t> strata;
        for (std::uint32_t i = 0; i < kCount; ++i) {
          const std::uint32_t index = shuffle_index(first + i, seed * 31 + 5);
          strata.insert(owen_scramble(sobol_bits(index, d), seed + static_cast<std::uint32_t>(d)) >> 24);
        }
        EXPECT_EQ(strata.size(), kCount);
      }
}

TEST(Sobol, FirstTwoDimensionsFormNetsInEveryElementaryInterval) {
  constexpr unsigned kBits = 8;
  for (unsigned split = 0; split <= kBits; ++split) {
    std::set<std::uint32_t> cells;
    for (std::uint32_t i = 0; i < (1u << kBits); ++i) {
      const std::uint64_t x = owen_scramble(sobol_bits(i, 0), 11), y = owen_scramble(sobol_bits(i, 1), 12);
      cells.insert(static_cast<std::uint32_t>(((x >> (32 - split)) << 16) | (y >> (32 - kBits + split))));
    }
    EXPECT_EQ(cells.size(), 1u << kBits) << split;
  }
}

TEST(Sobol, ScramblingIsUniform) {
  // Mean and variance of one scrambled point over seeds: 20,000 seeds, at 4.5 standard errors (false alarm 7e-6 each).
  constexpr int kSeeds = 20000;
  for (const std::uint32_t point : {0u, 1u, 0x80000000u, 0x12345678u}) {
    double sum = 0, sum2 = 0;
    for (int seed = 0; seed < kSeeds; ++seed) {
      const double x =
          owen_scramble(point, static_cast<std::uint32_t>(mix64(static_cast<std::uint64_t>(seed)))) * 0x1p-32;
      sum += x;
      sum2 += x * x;
    }
    EXPECT_NEAR(sum / kSeeds, 0.5, 4.5 * std::sqrt(1 / 12.0 / kSeeds));
    EXPECT_NEAR(sum2 / kSeeds, 1 / 3.0, 4.5 * std::sqrt(4 / 45.0 / kSeeds));
  }
}

}  // namespace
}  // namespace warpath
