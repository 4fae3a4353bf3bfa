#include "estimate/jittered_grid.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace warpath {
namespace {

TEST(JitteredGrid, HasOneRayInEachCell) {
  const JitteredGrid grid(7, 2, 100);
  EXPECT_EQ(grid.columns(), 3u);
  ASSERT_EQ(grid.cells(), 9u) << "at least 7, in whole rows";
  ASSERT_EQ(grid.rays(), 18u);
  for (std::size_t ray = 0; ray < grid.rays(); ++ray) {
    const Vec2 corner = grid.place(ray, {0, 0}), centre = grid.place(ray, {0.5f, 0.5f});
    const auto column = static_cast<float>(ray % 3), row = static_cast<float>(ray % 9 / 3);
    EXPECT_FLOAT_EQ(corner.x, column / 3);
    EXPECT_FLOAT_EQ(corner.y, row / 3);
    EXPECT_FLOAT_EQ(centre.x, (column + 0.5f) / 3);
    EXPECT_FLOAT_EQ(centre.y, (row + 0.5f) / 3);
  }
}

TEST(JitteredGrid, NeedsNoMoreRowsThanItsRaysFill) {
  const JitteredGrid grid(6, 1, 100);
  EXPECT_EQ(grid.columns(), 3u);
  EXPECT_EQ(grid.cells(), 6u);
}

// Errors are told by neighbours of one batch, so a batch may not end within a row.
TEST(JitteredGrid, BatchesTakeEveryRayOnceInWholePixelsOrRowsOfOne) {
  for (const int rays_per_pixel : {1, 4, 16, 17, 100, 1000, 3000}) {
    for (const std::size_t pixels : {1u, 2u, 31u}) {
      const std::size_t lanes = 50;
      const JitteredGrid grid(rays_per_pixel, pixels, lanes);
      const std::size_t whole = grid.cells() <= lanes ? grid.cells() : grid.columns();
      EXPECT_EQ(grid.first_ray(0), 0u);
      EXPECT_EQ(grid.first_ray(grid.batches()), grid.rays());
      for (std::size_t batch = 0; batch < grid.batches(); ++batch) {
        const std::size_t begin = grid.first_ray(batch), end = grid.first_ray(batch + 1);
        ASSERT_LT(begin, end);
        EXPECT_LE(end - begin, std::max(lanes, grid.columns()));
        EXPECT_EQ(begin % whole, 0u);
        EXPECT_EQ(end % whole, 0u);
        if (grid.cells() > lanes) {
          EXPECT_EQ(begin / grid.cells(), (end - 1) / grid.cells()) << "rows of one pixel";
        }
      }
    }
  }
}

}  // namespace
}  // namespace warpath
