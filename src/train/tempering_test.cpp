#include "train/tempering.h"

#include <gtest/gtest.h>

#include <cmath>

namespace warpath {
namespace {

TEST(Tempering, CountsEqualWeights) {
  EXPECT_DOUBLE_EQ(effective_samples(std::vector<float>{2, 2, 2, 0}), 3);
  EXPECT_DOUBLE_EQ(effective_samples(std::vector<float>{0, 0}), 0);
  EXPECT_DOUBLE_EQ(effective_samples(std::vector<float>{}), 0);
}

TEST(Tempering, LeavesAsManyEffectiveSamplesAsAsked) {
  Examples examples{Matrix<float>(1000, 1), std::vector<float>(1000), std::vector<float>(1000, 1.0f)};
  for (std::size_t i = 0; i < 1000; ++i) examples.weight[i] = i % 10 == 3 ? 0 : std::exp(0.02f * static_cast<float>(i));
  const double before = effective_samples(examples.weight);
  const Examples result = tempered(examples, 400);
  EXPECT_LT(before, 120);
  EXPECT_NEAR(effective_samples(result.weight), 400, 1);
  const double b = std::log(static_cast<double>(result.weight[500])) / 10;  // ln of weight 500 was 10
  for (std::size_t i = 0; i < 1000; ++i)
    EXPECT_NEAR(result.weight[i], i % 10 == 3 ? 0 : std::exp(0.02 * b * static_cast<double>(i)),
                1e-4 * result.weight[999]);
  EXPECT_EQ(result.inv_q, examples.inv_q);
  EXPECT_NEAR(tempering(examples.weight, 400), b, 1e-5);
  EXPECT_NEAR(effective_samples(examples.weight, b), 400, 1);
  // What does not need it stays as it is.
  EXPECT_NEAR(effective_samples(tempered(examples, 10).weight), before, 0.01);
}

}  // namespace
}  // namespace warpath
