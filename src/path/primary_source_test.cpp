#include "path/primary_source.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/rng.h"
#include "warpath/batch.h"

namespace warpath {
namespace {

constexpr std::uint64_t kSeed = 3;
const std::vector<std::uint64_t> kIds{40, 41, 42, 7};
const std::vector<std::uint32_t> kLanes{0, 2, 3};

TEST(UniformSource, GivesTheStreamOfEachSample) {
  UniformSource source(kSeed, kIds);
  std::vector<float> u0(3), u1(3);
  EXPECT_FALSE(source.draw({GroupKind::light_uv, 2}, kLanes, nullptr, u0.data(), u1.data(), nullptr));
  const std::uint32_t d = Group{GroupKind::light_uv, 2}.first_dimension();
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(u0[i], sample_float(sample_key(kSeed, kIds[kLanes[i]]), d));
    EXPECT_EQ(u1[i], sample_float(sample_key(kSeed, kIds[kLanes[i]]), d + 1));
  }
}

TEST(UniformSource, WritesOneNumberForGroupsOfOne) {
  UniformSource source(kSeed, kIds);
  std::vector<float> u0(3);
  EXPECT_FALSE(source.draw({GroupKind::rr, 1}, kLanes, nullptr, u0.data(), nullptr, nullptr));
  EXPECT_EQ(u0[1], sample_float(sample_key(kSeed, 42), Group{GroupKind::rr, 1}.first_dimension()));
}

TEST(UniformSource, DoesNotDependOnTheOrderOfDraws) {
  UniformSource a(kSeed, kIds), b(kSeed, kIds);
  std::vector<float> first(3), other(3), again(3);
  a.draw({GroupKind::time}, kLanes, nullptr, first.data(), nullptr, nullptr);
  b.draw({GroupKind::lobe, 5}, kLanes, nullptr, other.data(), nullptr, nullptr);
  b.draw({GroupKind::time}, kLanes, nullptr, again.data(), nullptr, nullptr);
  EXPECT_EQ(first, again);
  EXPECT_NE(first, other);
}

TEST(FixedSource, HandsOutTheChosenColumnsAndUniformNumbersForTheRest) {
  const Layout layout = Layout::parse("film+bounce1");
  Matrix<double> y(4, 6);  // two columns more than the layout has: a stride
  for (std::size_t i = 0; i < y.values().size(); ++i) y.values()[i] = (static_cast<double>(i) + 0.5) / 24;
  y(2, 1) = 1 - 0x1p-53;
  FixedSource fixed(kSeed, kIds, layout, y.batch().data(), 6);
  UniformSource uniform(kSeed, kIds);
  std::vector<float> u0(3), u1(3), v0(3), v1(3);
  EXPECT_FALSE(fixed.draw({GroupKind::film}, kLanes, nullptr, u0.data(), u1.data(), nullptr));
  EXPECT_EQ(u0[1], static_cast<float>(y(2, 0)));
  EXPECT_EQ(u1[1], 0x1.fffffep-1f);  // still below 1 as a float
  EXPECT_FALSE(fixed.draw({GroupKind::dir, 1}, kLanes, nullptr, u0.data(), u1.data(), nullptr));
  EXPECT_EQ(u0[2], static_cast<float>(y(3, 2)));
  EXPECT_EQ(u1[2], static_cast<float>(y(3, 3)));
  fixed.draw({GroupKind::dir, 2}, kLanes, nullptr, u0.data(), u1.data(), nullptr);
  uniform.draw({GroupKind::dir, 2}, kLanes, nullptr, v0.data(), v1.data(), nullptr);
  EXPECT_EQ(u0, v0);
  EXPECT_EQ(u1, v1);
}

}  // namespace
}  // namespace warpath
