#include "tracer/distribution.h"

#include <gtest/gtest.h>

#include "core/rng.h"

namespace warpath {
namespace {

TEST(DiscreteDistribution, SharesOfTheUnitIntervalAreTheProbabilities) {
  const std::vector<float> weights{0, 2, 0, 1, 5, 0};
  const DiscreteDistribution d(weights);
  EXPECT_DOUBLE_EQ(d.total(), 8);
  std::vector<int> counts(weights.size());
  const int n = 8000;
  for (int i = 0; i < n; ++i) {
    float rest;
    const std::size_t k = d.sample((i + 0.5f) / n, rest);
    ++counts[k];
    EXPECT_GE(rest, 0);
    EXPECT_LT(rest, 1);
  }
  for (std::size_t k = 0; k < weights.size(); ++k) {
    EXPECT_NEAR(counts[k], weights[k] / 8 * n, 1);
    EXPECT_FLOAT_EQ(d.probability(k), weights[k] / 8);
  }
  float rest;
  EXPECT_EQ(d.sample(0, rest), 1u);
  EXPECT_EQ(d.sample(kOneMinusEpsilon, rest), 4u);
}

// The map is exact if cells of equal area in u carry equal mass: the density at the image of u, times the map's
// Jacobian, is 1.
TEST(BilinearDistribution, JacobianOfTheMapIsOneOverTheDensity) {
  std::vector<float> values;
  const int width = 7, height = 5;
  for (int i = 0; i < width * height; ++i) values.push_back(0.05f + sample_float(3, static_cast<std::uint32_t>(i)));
  const BilinearDistribution d(values, width, height);
  const float h = 1e-3f;
  for (int i = 0; i < 500; ++i) {
    const Vec2 u(0.01f + 0.98f * sample_float(4, 2 * i), 0.01f + 0.98f * sample_float(4, 2 * i + 1));
    float pdf, other;
    const Vec2 p = d.sample(u, pdf);
    EXPECT_NEAR(pdf, d.pdf(p), 1e-4f * (1 + pdf));
    const Vec2 du = (d.sample({u.x + h, u.y}, other) - d.sample({u.x - h, u.y}, other)) / (2 * h);
    const Vec2 dv = (d.sample({u.x, u.y + h}, other) - d.sample({u.x, u.y - h}, other)) / (2 * h);
    EXPECT_NEAR(std::fabs(du.x * dv.y - du.y * dv.x) * pdf, 1, 0.05) << u;
  }
}

TEST(BilinearDistribution, IntegratesToOneAndAvoidsWhatIsBlack) {
  const int width = 4, height = 3;
  const std::vector<float> values{0, 0, 0, 0, 0, 0, 3, 0, 0, 0, 0, 0};
  const BilinearDistribution d(values, width, height);
  EXPECT_NEAR(d.average(), 3.0f / 6, 1e-6f);  // one peak of volume 3 over a cell, 6 cells
  double sum = 0;
  const int n = 300;
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) sum += d.pdf({(x + 0.5f) / n, (y + 0.5f) / n});
  EXPECT_NEAR(sum / (n * n), 1, 1e-3);
  for (int i = 0; i < 1000; ++i) {
    float pdf;
    const Vec2 p = d.sample({sample_float(5, 2 * i), sample_float(5, 2 * i + 1)}, pdf);
    EXPECT_GE(p.x, 1 / 3.0f - 1e-6f);
    EXPECT_GT(pdf, 0);
  }
}

TEST(BilinearDistribution, BlackEverywhereIsUniform) {
  const BilinearDistribution d(std::vector<float>(6, 0.0f), 3, 2);
  float pdf;
  const Vec2 p = d.sample({0.3f, 0.6f}, pdf);
  EXPECT_NEAR((p - Vec2(0.3f, 0.6f)).length(), 0, 1e-6f);
  EXPECT_FLOAT_EQ(pdf, 1);
}

}  // namespace
}  // namespace warpath
