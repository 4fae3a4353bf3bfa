#include "report/densities.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "warpath/error.h"

namespace warpath {
namespace {

TEST(Densities, ComeBackAsTheyWere) {
  const std::filesystem::path path =
      std::filesystem::path(testing::TempDir()) / ("densities_" + std::to_string(getpid()) + ".json");
  EXPECT_TRUE(read_densities(path).empty());
  const DensityPicture picture{"kdtree:film", "film.x", "film.y", "", {2, 1, {0.1f, 1.9f}}, {2, 1, {0.3f, 1.7f}}};
  write_densities(path, {picture, picture});
  const std::vector<DensityPicture> read = read_densities(path);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[1].method, "kdtree:film");
  EXPECT_EQ(read[1].y_dimension, "film.y");
  EXPECT_EQ(read[1].learned.values, picture.learned.values);
  EXPECT_EQ(read[1].candidates.values, picture.candidates.values);
  EXPECT_EQ(read[1].learned.width, 2);
  std::ofstream(path) << "[{]";
  EXPECT_THROW(read_densities(path), FileError);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace warpath
