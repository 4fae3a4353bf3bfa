#include "warpath/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace warpath {
namespace {

using testing::HasSubstr;

constexpr std::string_view kKnown[] = {"roughplastic", "plastic", "diffuse"};

TEST(Suggestion, NamesTheNearest) {
  EXPECT_EQ(suggestion("rougplastic", kKnown), " did you mean \"roughplastic\"?");
  EXPECT_EQ(suggestion("plasitc", kKnown), " did you mean \"plastic\"?");
  EXPECT_EQ(suggestion("difuse", kKnown), " did you mean \"diffuse\"?");
}

TEST(Suggestion, ListsTheKnownWhereNoneIsNear) {
  EXPECT_EQ(suggestion("hair", kKnown), " known: roughplastic, plastic, diffuse");
  EXPECT_EQ(suggestion("", std::span<const std::string_view>{}), " known: ");
}

TEST(Check, TellsBothValuesAndThePlace) {
  const auto text = [](const auto& f) {
    try {
      f();
    } catch (const InternalError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_EQ(text([] { WARPATH_CHECK_EQ(2 + 2, 4); }), "no error");
  EXPECT_THAT(text([] { WARPATH_CHECK_EQ(2 + 2, 5); }), HasSubstr("check failed: 2 + 2 == 5 (4 against 5)"));
  EXPECT_THAT(text([] { WARPATH_CHECK(1 > 2); }), HasSubstr("error_test.cpp"));
  EXPECT_THAT(text([] { WARPATH_CHECK(1 > 2); }), HasSubstr("check failed: 1 > 2"));
}

TEST(Check, EvaluatesItsArgumentsOnce) {
  int calls = 0;
  WARPATH_CHECK_EQ(++calls, 1);
  WARPATH_CHECK(++calls == 2);
  EXPECT_EQ(calls, 2);
}

}  // namespace
}  // namespace warpath
