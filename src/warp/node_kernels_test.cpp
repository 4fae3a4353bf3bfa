#include "warp/node_kernels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/rng.h"
#include "warp/field.h"

namespace warpath {
namespace {

/// A tree with random weights, the prior of a field's cell, and the features of a vertex.
struct Example {
  Example(const HalvingGrid& grid, std::uint64_t seed, bool with_prior) : tree(grid) {
    const auto number = [&](std::uint32_t stream, std::size_t i) {
      return 2 * sample_float(sample_key(seed, stream), static_cast<std::uint32_t>(i)) - 1;
    };
    weights.resize(tree.parameter_count());
    for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = 0.3f * number(0, i);
    features.resize(kNodeFeatures);
    for (std::size_t i = 0; i < features.size(); ++i) features[i] = number(1, i);
    if (!with_prior) return;
    std::vector<float> mass(grid.bins());
    for (std::uint32_t b = 0; b < grid.bins(); ++b) mass[b] = grid.volume(b) * (1.1f + number(2, b));
    cumulative.resize(grid.stored());
    grid.set_density(mass, cumulative.data());
  }
  const CumulativeProbability* prior() const { return cumulative.empty() ? nullptr : cumulative.data(); }
  float draw(const std::array<double, 3>& z, std::array<float, 3>& y) const {
    std::array draws{NodeDraw{&tree, weights.data(), prior(), features.data(), z, {}, 0}};
    sample_nodes(draws);
    y = draws[0].y;
    return draws[0].inv_q;
  }
  double density(std::uint32_t bin) const {
    return 1 / static_cast<double>(inverse_node_density(tree, weights.data(), prior(), features.data(), bin));
  }
  NodeTree tree;
  nn::AlignedVector<float> weights, features;
  std::vector<CumulativeProbability> cumulative;
};

std::vector<HalvingGrid> grids() {
  std::vector<HalvingGrid> all{FieldGrids(1).diffuse, FieldGrids(1).mixed, FieldGrids(1).delta};
  for (const int parts : {1, 3, 5, 93}) all.push_back(FieldGrids(parts).light);
  return all;
}

class NodeKernels : public testing::TestWithParam<std::string> {
 protected:
  NodeKernels() : m_target(GetParam()) {}
  nn::ForceSimdTarget m_target;
};
INSTANTIATE_TEST_SUITE_P(Targets, NodeKernels, testing::ValuesIn(nn::simd_targets()),
                         [](const auto& info) { return info.param; });

TEST_P(NodeKernels, DensitiesIntegrateToOne) {
  for (const HalvingGrid& grid : grids())
    for (const bool with_prior : {false, true}) {
      const Example e(grid, 1, with_prior);
      double sum = 0;
      for (std::uint32_t b = 0; b < grid.bins(); ++b)
        if (grid.volume(b) > 0) sum += e.density(b) * static_cast<double>(grid.volume(b));
      EXPECT_NEAR(sum, 1, 2e-5);
    }
}

TEST_P(NodeKernels, WithoutWeightsTheDensityIsThePrior) {
  for (const HalvingGrid& grid : grids())
    for (const bool with_prior : {false, true}) {
      Example e(grid, 2, with_prior);
      std::fill(e.weights.begin(), e.weights.end(), 0.0f);
      for (std::uint32_t b = 0; b < grid.bins(); ++b) {
        if (!(grid.volume(b) > 0)) continue;
        const double prior = with_prior ? 1 / static_cast<double>(grid.inverse_density(e.prior(), b)) : 1;
        EXPECT_NEAR(e.density(b) / prior, 1, 1e-5);
      }
    }
}

TEST_P(NodeKernels, DensityIsNeverFarBelowThePrior) {
  const HalvingGrid grid = FieldGrids(3).light;
  Example e(grid, 3, true);
  for (float& w : e.weights) w *= 100;
  for (std::uint32_t b = 0; b < grid.bins(); ++b)
    if (grid.volume(b) > 0) {
      EXPECT_GT(e.density(b) * static_cast<double>(grid.inverse_density(e.prior(), b)),
                0.999 * static_cast<double>(NodeTree::kPriorShare));
    }
}

// Pearson's test over all bins, of 400 n/bin on average: beyond 4.5 standard deviations of chi-squared in less than
// 1e-4 of all choices of seeds (its tail is heavier than the normal one's), for each of 14 cases.
TEST_P(NodeKernels, SamplesFollowTheDensityThatTheyAreDividedBy) {
  constexpr std::uint64_t kSeed = 4;
  for (const HalvingGrid& grid : grids())
    for (const bool with_prior : {false, true}) {
      const Example e(grid, kSeed, with_prior);
      const std::size_t n = 40 * grid.bins();
      std::vector<double> drawn(grid.bins());
      std::array<float, 3> y;
      for (std::size_t i = 0; i < n; ++i) {
        const std::uint64_t key = sample_key(kSeed + 100, i);
        const float inv_q = e.draw({sample_double(key, 0), sample_double(key, 1), sample_double(key, 2)}, y);
        for (const float number : y) ASSERT_TRUE(number >= 0 && number < 1);
        const std::uint32_t bin = grid.bin(y[0], y[1], y[2]);
        ASSERT_NEAR(static_cast<double>(inv_q) * e.density(bin), 1, 1e-5);
        ++drawn[bin];
      }
      double chi2 = 0, bins = 0;
      for (std::uint32_t b = 0; b < grid.bins(); ++b) {
        if (!(grid.volume(b) > 0)) {
          EXPECT_EQ(drawn[b], 0);
          continue;
        }
        const double expected = static_cast<double>(n) * e.density(b) * static_cast<double>(grid.volume(b));
        chi2 += (drawn[b] - expected) * (drawn[b] - expected) / expected;
        ++bins;
      }
      EXPECT_LT(std::fabs(chi2 - (bins - 1)) / std::sqrt(2 * bins), 4.5) << "seed " << kSeed;
    }
}

// The ends of the latents' range, and features so large that children all but vanish.
TEST_P(NodeKernels, ExtremesStayInsideTheCube) {
  const HalvingGrid grid = FieldGrids(5).light;
  Example e(grid, 5, true);
  for (float& f : e.features) f *= 1000;
  std::array<float, 3> y;
  for (const double a : {0.0, 0.5, 0x1.fffffffffffffp-1})
    for (const double b : {0.0, 0.5, 0x1.fffffffffffffp-1}) {
      const float inv_q = e.draw({a, b, a}, y);
      EXPECT_TRUE(std::isfinite(inv_q) && inv_q > 0);
      for (const float number : y) EXPECT_TRUE(number >= 0 && number < 1);
      EXPECT_GT(grid.volume(grid.bin(y[0], y[1], y[2])), 0);
    }
}

TEST_P(NodeKernels, GradientsAreThoseOfFiniteDifferences) {
  const HalvingGrid grid = FieldGrids(3).light;
  for (const bool with_prior : {false, true}) {
    Example e(grid, 6, with_prior);
    const std::uint32_t bin = grid.bin(0.5f, 0.3f, 0.8f);
    constexpr float kWeight = 1.7f;
    std::vector<float> transposed(e.tree.nodes() * NodeTree::kChildren * kNodeFeatures);
    nn::AlignedVector<float> aligned(transposed.size());
    transpose_nodes(e.tree, e.weights.data(), aligned.data());
    nn::AlignedVector<float> d_weights(e.weights.size()), d_features(kNodeFeatures);
    const float log_q = train_nodes(e.tree, e.weights.data(), aligned.data(), e.prior(), e.features.data(), bin,
                                    kWeight, d_weights.data(), d_features.data());
    EXPECT_NEAR(static_cast<double>(log_q), std::log(e.density(bin)), 1e-5);
    const auto check = [&](float& parameter, float gradient) {
      constexpr float kStep = 2e-2f;
      const float before = parameter;
      parameter = before + kStep;
      const double above = -static_cast<double>(kWeight) * std::log(e.density(bin));
      parameter = before - kStep;
      const double below = -static_cast<double>(kWeight) * std::log(e.density(bin));
      parameter = before;
      EXPECT_NEAR(static_cast<double>(gradient), (above - below) / (2 * static_cast<double>(kStep)), 1e-3);
    };
    double largest = 0;
    for (std::uint32_t depth = 0; depth < grid.depth(); ++depth) {
      const std::size_t first = grid.node_above(bin, depth) * NodeTree::kNodeSize;
      for (std::size_t i = first; i < first + NodeTree::kNodeSize; i += 7) {
        check(e.weights[i], d_weights[i]);
        largest = std::max(largest, static_cast<double>(std::fabs(d_weights[i])));
      }
    }
    for (std::size_t f = 0; f < kNodeFeatures; ++f) check(e.features[f], d_features[f]);
    EXPECT_GT(largest, 0.1) << "else the test could not fail";
  }
}

}  // namespace
}  // namespace warpath
