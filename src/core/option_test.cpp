#include "core/option.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "warpath/error.h"

namespace warpath {
namespace {

using testing::ThrowsMessage;

TEST(Option, WholeNumbersAreReadWholeAndInRange) {
  int value = 5;
  const OptionValue option = whole(value, 1, 64);
  EXPECT_EQ(option.domain, "1 to 64");
  option.set("64");
  EXPECT_EQ(value, 64);
  for (const char* wrong : {"0", "65", "-1", "3.5", "3x", "", " 3", "99999999999999999999", "nan"})
    EXPECT_THROW(option.set(wrong), ConfigError) << wrong;
  EXPECT_EQ(value, 64) << "what is refused changes nothing";
  EXPECT_THAT([&] { option.set("nan"); }, ThrowsMessage<ConfigError>("\"nan\" is not a whole number, 1 to 64"));
}

TEST(Option, NumbersBeyondWhatATypeHoldsAreRefused) {
  std::uint64_t value = 0;
  const OptionValue option = whole(value, 0, std::numeric_limits<std::uint64_t>::max());
  option.set("18446744073709551615");
  EXPECT_EQ(value, std::numeric_limits<std::uint64_t>::max());
  EXPECT_THROW(option.set("18446744073709551616"), ConfigError);
  EXPECT_THROW(option.set("-1"), ConfigError);
}

TEST(Option, NumbersAreFinite) {
  double value = 0.5;
  const OptionValue closed = real(value, 0, 1), open = above(0, value, 1e9);
  closed.set("0");
  EXPECT_EQ(value, 0);
  closed.set("2.5e-1");
  EXPECT_EQ(value, 0.25);
  for (const char* wrong : {"nan", "inf", "-inf", "1.5", "1e300", "-0.1"}) EXPECT_THROW(closed.set(wrong), ConfigError);
  for (const char* wrong : {"nan", "inf", "0", "-1", "1e300"}) EXPECT_THROW(open.set(wrong), ConfigError) << wrong;
}

TEST(Option, NamesAreSuggested) {
  enum class Colour { red, green } colour = Colour::red;
  const OptionValue option = one_of(colour, {{"red", Colour::red}, {"green", Colour::green}});
  EXPECT_EQ(option.domain, "red or green");
  EXPECT_EQ(option.get(), "red");
  option.set("green");
  EXPECT_EQ(colour, Colour::green);
  EXPECT_THAT([&] { option.set("gren"); }, ThrowsMessage<ConfigError>(testing::HasSubstr("did you mean \"green\"?")));
}

TEST(Option, OneRowServesSeveralUsersAndTellsTheirDefaults) {
  int a = 16, b = 6;
  const Option option{"width", "Group", "How wide", {{"first", whole(a, 1, 64)}, {"second", whole(b, 1, 64)}}};
  EXPECT_EQ(option.defaults(), "16; second: 6");
  option.set("8", "--width");
  EXPECT_EQ(a, 8);
  EXPECT_EQ(b, 8);
  EXPECT_THAT([&] { option.set("0", "--width"); },
              ThrowsMessage<ConfigError>("--width: \"0\" is not a whole number, 1 to 64"));
}

TEST(Option, OptionalValuesHaveNoDefault) {
  std::optional<double> seconds;
  const Option option{"time", "Group", "How long", {{"", above(0, seconds, 10)}}};
  EXPECT_EQ(option.defaults(), "");
  option.set("1.5", "--time");
  EXPECT_EQ(seconds, 1.5);
}

}  // namespace
}  // namespace warpath
