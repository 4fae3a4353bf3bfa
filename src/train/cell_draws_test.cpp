#include "train/cell_draws.h"

#include <gtest/gtest.h>

namespace warpath {
namespace {

using ByShare = std::array<double, kUniformShares.size()>;

TEST(CellDraws, SumsTellMeanAndEffectiveDraws) {
  CellDraws draws;
  EXPECT_EQ(draws.mean(), 0);
  EXPECT_EQ(draws.effective(), 0);
  for (const float term : {1.0f, 1.0f, 1.0f, 1.0f, 0.0f}) draws.add(term, 1);
  EXPECT_DOUBLE_EQ(draws.mean(), 0.8);
  EXPECT_DOUBLE_EQ(draws.effective(), 4) << "a draw of nothing tells nothing";
  draws.add(100, 1);
  EXPECT_NEAR(draws.effective(), 104.0 * 104 / 10004, 1e-12) << "one outshines all others";
  draws.halve();
  EXPECT_DOUBLE_EQ(draws.n, 3);
  EXPECT_DOUBLE_EQ(draws.mean(), 104.0 / 6);
  EXPECT_NEAR(draws.effective(), 104.0 * 104 / 10004 / 2, 1e-12);
}

TEST(CellDraws, NothingIsSaidOfSharesUntilADensityIsLearned) {
  CellDraws draws;
  draws.add(2, 0.5f);
  for (const float square : draws.with_share) EXPECT_EQ(square, 0);
}

// q = 1 - 0.6 + 0.6 p = 2.2 where the learned density p is 3. A draw with another share of uniform numbers u would have
// had the density u + (1 - u) 3, and its square would have come as often as that says:
// (f / q)^2 q / (u + (1 - u) 3).
TEST(CellDraws, SecondMomentsOfOtherSharesAreThoseOfTheirDensities) {
  CellDraws draws;
  draws.add(2, 1);
  draws.begin_pass(0.6);
  draws.add(2, 1 / 2.2f);
  for (std::size_t s = 0; s < kUniformShares.size(); ++s) {
    const float u = kUniformShares[s];
    EXPECT_NEAR(draws.with_share[s], 4 * 2.2f / (u + (1 - u) * 3), 1e-5) << s;
  }
  const float before = draws.with_share[0];
  draws.begin_pass(0.7);
  EXPECT_FLOAT_EQ(draws.learned, 0.7f);
  EXPECT_FLOAT_EQ(draws.with_share[0], before / 2) << "drawn with a density that is no more";
}

TEST(CellDraws, OneDrawDoesNotChooseAlone) {
  CellDraws draws;
  draws.add(1, 1);
  draws.begin_pass(0.5);
  CellDraws bright = draws;
  draws.add(20, 1);
  bright.add(1e6f, 1);
  EXPECT_EQ(draws.with_share, bright.with_share) << "20 times the mean is the most that counts";
  EXPECT_GT(bright.sum, draws.sum);
}

CellDraws best_with(std::size_t best, double effective) {
  CellDraws draws;
  draws.n = draws.sum = draws.square = effective;
  draws.with_share.fill(2);
  draws.with_share[best] = 1;
  return draws;
}

TEST(UniformShare, IsTheOneWithTheLeastSecondMoment) {
  for (std::size_t s = 0; s < kUniformShares.size(); ++s)
    EXPECT_DOUBLE_EQ(best_uniform_share(best_with(s, 10), {}, 0.4), kUniformShares[s]);
}

TEST(UniformShare, IsWhatOthersSayWhereACellHasSeenLittle) {
  PooledShares pool;
  pool.add(best_with(4, 1000));
  EXPECT_DOUBLE_EQ(best_uniform_share({}, pool.mean(), 0.4), kUniformShares[4]);
  EXPECT_DOUBLE_EQ(best_uniform_share(best_with(1, 8), pool.mean(), 0.4), kUniformShares[4]);
  EXPECT_DOUBLE_EQ(best_uniform_share(best_with(1, 800), pool.mean(), 0.4), kUniformShares[1]);
}

TEST(UniformShare, IsTheGivenOneWhereNobodyKnows) { EXPECT_DOUBLE_EQ(best_uniform_share({}, {}, 0.4), 0.4); }

TEST(PooledShares, AverageByEffectiveDraws) {
  PooledShares pool;
  EXPECT_EQ(pool.mean(), ByShare{});
  pool.add({});  // has drawn from no learned density
  EXPECT_EQ(pool.mean(), ByShare{});
  pool.add(best_with(0, 30));
  pool.add(best_with(1, 10));
  const ByShare mean = pool.mean();
  EXPECT_NEAR(mean[0], (0.75 * 1 + 0.25 * 2) / 11, 1e-12);
  EXPECT_NEAR(mean[1], (0.75 * 2 + 0.25 * 1) / 11, 1e-12);
  EXPECT_NEAR(mean[5], 2.0 / 11, 1e-12);
}

}  // namespace
}  // namespace warpath
