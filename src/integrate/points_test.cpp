#include "integrate/points.h"

#include <gtest/gtest.h>

#include <vector>

namespace warpath {
namespace {

TEST(Points, ReplicatesHoldAPowerOfTwoAndASecondSequence) {
  for (const std::size_t count : {64u, 1000u, 20'000u, 100'000u, 1'000'000u})
    for (const bool defended : {false, true}) {
      const Points points(Points::Kind::sobol, 1, 0, count, defended);
      EXPECT_LE(points.count(), count);
      EXPECT_GT(static_cast<double>(points.count()), 0.93 * static_cast<double>(count)) << "hardly any is lost";
      EXPECT_GE(points.replicates(), 16u);
      EXPECT_LT(points.replicates(), 33u);
      if (defended) {
        EXPECT_GE(points.second_share(), 1.0 / 33);
      } else {
        EXPECT_EQ(points.second_share(), 0);
      }
    }
}

// A (0, 1)-sequence in each dimension: of 2^k points every one of as many intervals has one.
TEST(Points, EachSequenceIsStratified) {
  const Points points(Points::Kind::sobol, 3, 5, 16 * (256 + 8), true);
  ASSERT_EQ(points.replicate_size(), 264u);
  Matrix<double> z(points.count(), 3);
  std::vector<double> u(points.count());
  points.fill(0, z.batch(), u);
  for (std::size_t r = 0; r < points.replicates(); ++r)
    for (std::size_t d = 0; d < 3; ++d) {
      std::vector<int> main(256), second(8);
      for (std::size_t i = 0; i < 264; ++i) {
        const std::size_t row = r * 264 + i;
        const bool of_second = u[row] >= 1 - points.second_share();
        EXPECT_EQ(of_second, i >= 256);
        ++(of_second ? second[static_cast<std::size_t>(z(row, d) * 8)]
                     : main[static_cast<std::size_t>(z(row, d) * 256)]);
      }
      EXPECT_EQ(main, std::vector<int>(256, 1));
      EXPECT_EQ(second, std::vector<int>(8, 1));
    }
}

TEST(Points, APartIsTheSameAsInTheWhole) {
  for (const auto kind : {Points::Kind::independent, Points::Kind::sobol}) {
    const Points points(kind, 3, 5, 5000, true);
    Matrix<double> all(points.count(), 4), part(100, 4);
    std::vector<double> u_all(points.count()), u_part(100);
    points.fill(0, all.batch(), u_all);
    points.fill(777, part.batch(), u_part);
    for (std::size_t i = 0; i < 100; ++i) {
      EXPECT_EQ(u_part[i], u_all[777 + i]);
      for (std::size_t d = 0; d < 4; ++d) EXPECT_EQ(part(i, d), all(777 + i, d));
    }
  }
}

}  // namespace
}  // namespace warpath
