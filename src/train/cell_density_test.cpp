#include "train/cell_density.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "core/rng.h"
#include "warpath/error.h"

namespace warpath {
namespace {

const CellBelief kBelief{48, 1, 0.2};

/// A cell that saw these bins, all of whose hits were of the same f / q.
struct Cell {
  Cell(std::vector<CellBin> seen, double hit) : bins(std::move(seen)) {
    for (const CellBin& bin : bins) draws.n += bin.draws, draws.sum += bin.sum;
    draws.square = draws.sum * hit;
  }
  struct Density {
    double learned;
    std::vector<float> masses;
  };
  Density fit(const HalvingGrid& grid, const CellBelief& belief = kBelief) const {
    Density density{0, std::vector<float>(grid.bins())};
    density.learned = fit_cell_density(grid, bins, draws, belief, density.masses);
    return density;
  }
  std::vector<CellBin> bins;
  CellDraws draws;
};

/// Sums that have nothing to do with each other.
Cell random_cell(const HalvingGrid& grid, std::uint64_t seed) {
  std::vector<CellBin> bins(grid.bins());
  for (std::uint32_t b = 0; b < grid.bins(); ++b) {
    const std::uint64_t key = sample_key(seed, b);
    if (!(grid.volume(b) > 0) || sample_float(key, 0) < 0.2f) continue;
    bins[b].draws = std::floor(40 * sample_float(key, 1));
    bins[b].sum = bins[b].draws * sample_float(key, 2) * sample_float(key, 3);
  }
  return {std::move(bins), 3};
}

TEST(CellDensity, TwoBinsByHand) {
  const HalvingGrid grid({0, 1, 0});
  // 40 hits of 1 in 32 draws, so 40 of them are effective: s = 0.8 x 40 / 41. Of the halves 16 / (16 + 48) = 0.25 would
  // be believed, but X = 40 x 0.25^2 / 0.25 = 10 says 1 - 4 / 10. Means 1.875 and 0.625 are drawn to 1.25:
  // 0.6 x 1.875 + 0.4 x 1.25 = 1.625, and 0.875.
  const auto [learned, masses] = Cell({{30, 16}, {10, 16}}, 1).fit(grid);
  const double s = 0.8 * 40 / 41;
  EXPECT_DOUBLE_EQ(learned, s);
  EXPECT_FLOAT_EQ(masses[0], static_cast<float>(0.5 * (1 - s + s * 1.625 / 1.25)));
  EXPECT_FLOAT_EQ(masses[1], static_cast<float>(0.5 * (1 - s + s * 0.875 / 1.25)));
}

TEST(CellDensity, DifferencesThatChanceMakesAreShrunk) {
  const HalvingGrid grid({0, 1, 0});
  // Hits of 4: X = 10 / 4 x 0.25 is within chance, so 0.25 is believed: 0.25 x 1.875 + 0.75 x 1.25 = 1.40625.
  const auto [learned, masses] = Cell({{30, 16}, {10, 16}}, 4).fit(grid);
  const double s = 0.8 * 10 / 11;
  EXPECT_DOUBLE_EQ(learned, s);
  EXPECT_FLOAT_EQ(masses[0], static_cast<float>(0.5 * (1 - s + s * 1.40625 / 1.25)));
}

TEST(CellDensity, HalvesAreDrawnToTheirQuarter) {
  const HalvingGrid grid({0, 2, 0});
  // All within chance. Root 1; halves: 0.5 believed (16 draws, shrink 16) of means 1.5 and 0.5; quarters: 1/3 (8 draws)
  // of means 2, 1 below 1.25, and of 0.5, 0.5 below 0.75.
  const auto [learned, masses] = Cell({{16, 8}, {8, 8}, {4, 8}, {4, 8}}, 16).fit(grid, {16, 0, 0});
  EXPECT_DOUBLE_EQ(learned, 1);
  const double e[]{1.25 + 0.75 / 3, 1.25 - 0.25 / 3, 0.75 - 0.25 / 3, 0.75 - 0.25 / 3};
  const double sum = std::accumulate(std::begin(e), std::end(e), 0.0);
  for (std::size_t b = 0; b < 4; ++b) EXPECT_FLOAT_EQ(masses[b], static_cast<float>(e[b] / sum)) << b;
}

TEST(CellDensity, IsNormalisedAndNeverBelowItsUniformShare) {
  for (const HalvingGrid& grid : {HalvingGrid({1, 3, 2}), HalvingGrid({2, 2, 2}, 3), HalvingGrid({0, 1, 0})}) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      for (const double uniform : {0.05, 0.4, 0.9}) {
        const auto [learned, masses] = random_cell(grid, seed).fit(grid, {48, 1, uniform});
        EXPECT_NEAR(std::accumulate(masses.begin(), masses.end(), 0.0), 1, 1e-5);
        EXPECT_GE(learned, 0);
        EXPECT_LE(learned, 1 - uniform);
        for (std::uint32_t b = 0; b < grid.bins(); ++b)
          EXPECT_GE(masses[b], (1 - learned) * grid.volume(b) * (1 - 1e-6)) << "bin " << b << ", seed " << seed;
      }
    }
  }
}

TEST(CellDensity, PartsThatDoNotExistHaveNoMass) {
  const HalvingGrid grid({2, 1, 1}, 3);
  const auto [learned, masses] = random_cell(grid, 1).fit(grid);
  EXPECT_GT(learned, 0);
  int missing = 0;
  for (std::uint32_t b = 0; b < grid.bins(); ++b) {
    if (grid.volume(b) > 0) {
      EXPECT_GT(masses[b], 0);
    } else {
      EXPECT_EQ(masses[b], 0);
      ++missing;
    }
  }
  EXPECT_EQ(missing, 4);
}

TEST(CellDensity, WithoutShrinkageItGoesWithTheMeansOfBins) {
  const HalvingGrid grid({1, 2, 1});
  std::vector<CellBin> bins(grid.bins());
  for (std::uint32_t b = 0; b < grid.bins(); ++b) bins[b] = {sample_float(sample_key(2, b), 0), 1.0f + b};
  const Cell cell(bins, 1e6);
  const auto [learned, masses] = cell.fit(grid, {1e-9, 0, 0});
  EXPECT_DOUBLE_EQ(learned, 1);
  for (std::uint32_t b = 0; b < grid.bins(); ++b) EXPECT_NEAR(masses[b], cell.bins[b].sum / cell.draws.sum, 1e-6) << b;
}

TEST(CellDensity, WhatWasNeverDrawnIsLikeTheWholeThatItIsPartOf) {
  const HalvingGrid grid({0, 2, 0});
  const auto [learned, masses] = Cell({{12, 12}, {0, 0}, {4, 4}, {4, 4}}, 1e6).fit(grid, {1e-9, 0, 0});
  // Means over bins: 2.4, and 1.2 for the half that bin 1 is of; 0.8 and 0.8.
  EXPECT_NEAR(masses[0], 2.4 / 5.2, 1e-6);
  EXPECT_NEAR(masses[1], 1.2 / 5.2, 1e-6);
  EXPECT_NEAR(masses[2], 0.8 / 5.2, 1e-6);
}

TEST(CellDensity, UnderEndlessShrinkageWhatChanceMakesIsUniform) {
  const HalvingGrid grid({1, 2, 1});
  Cell cell = random_cell(grid, 2);
  cell.draws.square = 1e6 * cell.draws.sum;  // a hit or two
  const auto [learned, masses] = cell.fit(grid, {1e30, 0, 0});
  EXPECT_DOUBLE_EQ(learned, 1);
  for (std::uint32_t b = 0; b < grid.bins(); ++b) EXPECT_FLOAT_EQ(masses[b], grid.volume(b));
}

TEST(CellDensity, EqualBinsGiveTheUniformDensity) {
  const HalvingGrid grid({1, 2, 1});
  const auto [learned, masses] = Cell(std::vector<CellBin>(grid.bins(), {6, 5}), 2).fit(grid);
  EXPECT_GT(learned, 0.7);
  for (std::uint32_t b = 0; b < grid.bins(); ++b) EXPECT_FLOAT_EQ(masses[b], grid.volume(b));
}

// Light through a gap: few draws, so that shrinkage alone would believe a tenth of it.
TEST(CellDensity, AFewHitsInOneBinStandOut) {
  const HalvingGrid grid({0, 3, 3});
  std::vector<CellBin> bins(grid.bins(), {0, 1});
  bins[20].sum = 5;
  const auto [learned, masses] = Cell(bins, 1).fit(grid);
  EXPECT_GT(masses[20], 3 * grid.volume(20));
  EXPECT_EQ(std::max_element(masses.begin(), masses.end()) - masses.begin(), 20);
}

TEST(CellDensity, WhereNothingCameBackItIsUniform) {
  const HalvingGrid grid({2, 1, 1}, 3);
  for (const float draws : {0.0f, 7.0f}) {
    const auto [learned, masses] = Cell(std::vector<CellBin>(grid.bins(), {0, draws}), 1).fit(grid);
    EXPECT_EQ(learned, 0);
    for (std::uint32_t b = 0; b < grid.bins(); ++b) EXPECT_FLOAT_EQ(masses[b], grid.volume(b));
  }
}

TEST(CellDensity, TakesOneBinForEachOfTheGrid) {
  const HalvingGrid grid({0, 1, 0});
  std::vector<float> masses(2);
  EXPECT_THROW(fit_cell_density(grid, std::vector<CellBin>(3), {}, kBelief, masses), InternalError);
}

}  // namespace
}  // namespace warpath
