#include "path/latents.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "core/rng.h"

namespace warpath {
namespace {

constexpr std::uint64_t kSeed = 12;
constexpr std::uint32_t kDimensions = 26;  // camera and three vertices

/// `count` points of one stream from point `first` on: numbers[dimension][point].
std::vector<std::vector<double>> points(Sampler sampler, std::uint64_t stream, std::uint32_t first,
                                        std::uint32_t count) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 0; i < count; ++i) indices.push_back(first + i);
  Latents latents;
  latents.assign(sampler, kSeed, std::vector<std::uint64_t>(count, stream), indices);
  std::vector<std::vector<double>> numbers(kDimensions, std::vector<double>(count));
  for (std::uint32_t d = 0; d < kDimensions; ++d) latents.fill(d, numbers[d].data());
  return numbers;
}

TEST(Latents, IndependentOnesAreTheStreamsOfTheSamples) {
  const std::vector<std::uint64_t> ids{40, 41, 7};
  const Latents latents(kSeed, ids);
  std::vector<float> f(2);
  std::vector<double> d(3);
  latents.fill(9, std::vector<std::uint32_t>{0, 2}, f.data());
  latents.fill(9, d.data());
  EXPECT_EQ(f[0], sample_float(sample_key(kSeed, 40), 9));
  EXPECT_EQ(f[1], sample_float(sample_key(kSeed, 7), 9));
  EXPECT_EQ(d[1], sample_double(sample_key(kSeed, 41), 9));
}

TEST(Latents, AlignedRunsOfAPowerOfTwoStratifyEveryDimension) {
  for (const Sampler sampler : {Sampler::stratified, Sampler::sobol})
    for (const std::uint32_t count : {2u, 8u, 64u})
      for (const std::uint32_t first : {0u, 64u, 320u}) {
        const auto numbers = points(sampler, 5, first, count);
        for (const auto& of_dimension : numbers) {
          std::set<int> strata;
          for (const double u : of_dimension) strata.insert(static_cast<int>(u * count));
          EXPECT_EQ(strata.size(), count);
          EXPECT_GE(*strata.begin(), 0);
          EXPECT_LT(*strata.rbegin(), static_cast<int>(count));
        }
      }
}

TEST(Latents, NumbersOfAGroupOfTwoFormNets) {
  // film, lens and dir of the first vertex; 64 points, one in each rectangle of area 1/64.
  for (const auto& [sampler, d] :
       {std::pair{Sampler::stratified, 0u}, {Sampler::stratified, 2u}, {Sampler::stratified, 9u}, {Sampler::sobol, 0u}})
    for (int split = 0; split <= 6; ++split) {
      const auto numbers = points(sampler, 3, 64, 64);
      std::set<std::pair<int, int>> cells;
      for (std::size_t i = 0; i < 64; ++i)
        cells.insert({static_cast<int>(std::ldexp(numbers[d][i], split)),
                      static_cast<int>(std::ldexp(numbers[d + 1][i], 6 - split))});
      EXPECT_EQ(cells.size(), 64u) << sampler_name(sampler) << " " << d << " " << split;
    }
}

/// Correlation of two dimensions of the points of two streams, over many streams, with points that share an index.
TEST(Latents, DimensionsAndStreamsAreUncorrelated) {
  constexpr int kStreams = 4000;
  constexpr std::uint32_t kPoints = 8;
  const std::vector<std::uint32_t> dimensions{0, 1, 2, 4, 5, 6, 8, 9, 11, 12, 13, 19};
  for (const Sampler sampler : {Sampler::stratified, Sampler::sobol}) {
    std::vector<double> within(dimensions.size() * dimensions.size()), across(within.size());
    auto before = points(sampler, 0, 0, kPoints);
    for (std::uint64_t stream = 1; stream <= kStreams; ++stream) {
      auto numbers = points(sampler, stream, 0, kPoints);
      for (std::size_t a = 0; a < dimensions.size(); ++a)
        for (std::size_t b = 0; b < dimensions.size(); ++b)
          for (std::size_t i = 0; i < kPoints; ++i) {
            const double u = numbers[dimensions[a]][i] - 0.5;
            within[a * dimensions.size() + b] += u * (numbers[dimensions[b]][i] - 0.5);
            across[a * dimensions.size() + b] += u * (before[dimensions[b]][i] - 0.5);
          }
      before = std::move(numbers);
    }
    // The mean of 32,000 products of variance 1/144. 5 standard errors: a false alarm in 6e-7 each.
    const double n = double{kStreams} * kPoints, tolerance = 5 / 12.0 / std::sqrt(n);
    for (std::size_t a = 0; a < dimensions.size(); ++a)
      for (std::size_t b = 0; b < dimensions.size(); ++b) {
        const std::size_t k = a * dimensions.size() + b;
        EXPECT_NEAR(within[k] / n, a == b ? 1 / 12.0 : 0, tolerance) << dimensions[a] << " " << dimensions[b];
        EXPECT_NEAR(across[k] / n, 0, tolerance) << dimensions[a] << " " << dimensions[b];
      }
  }
}

TEST(Latents, FloatAndDoubleAreRoundingsOfTheSame) {
  for (const Sampler sampler : {Sampler::independent, Sampler::stratified, Sampler::sobol}) {
    Latents latents;
    latents.assign(sampler, kSeed, std::vector<std::uint64_t>{1, 2, 3}, std::vector<std::uint32_t>{0, 1, 9});
    std::vector<float> f(3);
    std::vector<double> d(3);
    for (const std::uint32_t dimension : {0u, 7u, kFirstFreeDimension}) {
      latents.fill(dimension, f.data());
      latents.fill(dimension, d.data());
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(f[i], d[i], 0x1p-24);
        EXPECT_LT(f[i], 1);
      }
    }
  }
}

}  // namespace
}  // namespace warpath
