#include "path/layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "warpath/error.h"

namespace warpath {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(Layout, ThePapersChoices) {
  const Layout layout = Layout::parse("film+bounce1+bounce2");  // [ZZ19]: 6D
  EXPECT_EQ(layout.dims(), 6);
  EXPECT_EQ(layout.name(), "film+bounce1.dir+bounce2.dir");
  EXPECT_EQ(layout.column({GroupKind::film}), 0);
  EXPECT_EQ(layout.column({GroupKind::dir, 1}), 2);
  EXPECT_EQ(layout.column({GroupKind::dir, 2}), 4);
  EXPECT_EQ(layout.column({GroupKind::lobe, 1}), -1);
  EXPECT_TRUE(layout.contains({GroupKind::film}));
  EXPECT_FALSE(layout.contains({GroupKind::dir, 3}));
}

TEST(Layout, ColumnsStandInThePathsOrder) {
  const Layout layout = Layout::parse("bounce2.light+time+bounce1+film+bounce1.lobe");
  EXPECT_EQ(layout.name(), "film+time+bounce1.lobe+bounce1.dir+bounce2.light");
  EXPECT_EQ(layout, Layout::parse("film+time+bounce1.lobe+bounce1+bounce2.light"));
  for (int column = 1; column < layout.dims(); ++column)
    EXPECT_LT(layout.dimension(column - 1), layout.dimension(column));
}

TEST(Layout, EveryNumberOfAPathHasItsOwnPlace) {
  std::set<std::uint32_t> places;
  std::size_t numbers = 0;
  const auto add = [&](Group group) {
    for (int i = 0; i < group.size(); ++i) places.insert(group.first_dimension() + static_cast<std::uint32_t>(i));
    numbers += static_cast<std::size_t>(group.size());
    EXPECT_EQ(Layout::parse(group.name()).groups()[0], group);
  };
  for (const GroupKind kind : {GroupKind::film, GroupKind::lens, GroupKind::time}) add({kind});
  for (std::uint16_t bounce = 1; bounce <= 20; ++bounce)
    for (const GroupKind kind : {GroupKind::light, GroupKind::light_uv, GroupKind::lobe, GroupKind::dir, GroupKind::rr})
      add({kind, bounce});
  EXPECT_EQ(numbers, kCameraDimensions + 20 * kBounceDimensions);
  EXPECT_EQ(places.size(), numbers);
  EXPECT_EQ(*places.rbegin() + 1, numbers);  // and none is left out
}

TEST(Layout, UnknownNamesAreErrorsThatListTheKnown) {
  for (const char* name :
       {"flim", "", "film+", "+film", "film++time", "bounce", "bounce0", "bounce1.", "bounce1.film", "bounce1.dirt",
        "bounce-1", "bounce1001", "bounce99999999999", "film.dir", "lobe", "bounce1 "})
    EXPECT_THAT([&] { Layout::parse(name); }, ThrowsMessage<ConfigError>(AllOf(HasSubstr("unknown dimension"),
                                                                               HasSubstr("film, lens, time, bounceK"))))
        << name;
}

TEST(Layout, ANameMayNotComeTwice) {
  EXPECT_THAT([] { Layout::parse("film+bounce1+bounce1.dir"); },
              ThrowsMessage<ConfigError>("dimension \"bounce1.dir\" is named twice in \"film+bounce1+bounce1.dir\""));
}

}  // namespace
}  // namespace warpath
