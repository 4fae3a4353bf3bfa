#include "family/training_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "family/family.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

TrainSettings settings_with(const std::string& name, const std::string& value) {
  TrainingOptions options;
  options.set(name, value);
  return options.settings(7);
}

TEST(TrainingOptions, WithoutAnyAreTheDefaults) {
  const TrainSettings settings = TrainingOptions().settings(7), defaults;
  EXPECT_EQ(settings.seed, 7u);
  EXPECT_EQ(settings.examples, defaults.examples);
  EXPECT_EQ(settings.realnvp.couplings, defaults.realnvp.couplings);
  EXPECT_EQ(settings.kdtree.target, KdTreeSettings::Target::second_moment);
}

TEST(TrainingOptions, GoToEveryFamilyThatReadsThem) {
  const TrainSettings settings = settings_with("width", "48");
  EXPECT_EQ(settings.realnvp.width, 48);
  EXPECT_EQ(settings.spline.width, 48);
  EXPECT_EQ(settings.conditional_spline.flow.width, 48);
  EXPECT_EQ(settings_with("epp", "0.5").examples, 16'000u);
  EXPECT_EQ(settings_with("max_steps", "3").spline.max_steps, 3) << "Python's spelling";
}

TEST(TrainingOptions, AnArchitectureIsChangedByWhatIsGivenBesideIt) {
  TrainingOptions options;
  options.set("width", "48");
  options.set("architecture", "released");
  EXPECT_EQ(options.settings(0).realnvp.width, 48);
  EXPECT_EQ(options.settings(0).realnvp.couplings, released_realnvp().couplings);
}

TEST(TrainingOptions, WhatNoFamilyUsesIsRefused) {
  TrainingOptions options(TrainingOptions::Spelling::command_line);
  options.set("couplings", "3");
  EXPECT_THAT([&] { options.check_used({"field"}); },
              ThrowsMessage<ConfigError>(HasSubstr("--couplings: field does not use it; it is for realnvp, spline")));
  EXPECT_NO_THROW(options.check_used({"none", "spline"})) << "one of them uses it";
  EXPECT_THROW(options.check_used({"none"}), ConfigError);
}

TEST(TrainingOptions, WhatWasCalledOtherwiseIsToldItsName) {
  TrainingOptions options;
  options.set("bins", "16");
  EXPECT_THAT([&] { options.check_used({"grid"}); },
              ThrowsMessage<ConfigError>("bins of a grid is now called intervals"));
  EXPECT_NO_THROW(options.check_used({"grid", "spline"}));
}

TEST(TrainingOptions, ExamplesAreForAllThatIsTrainedByItself) {
  TrainingOptions options;
  options.set("examples", "1000");
  EXPECT_THROW(options.check_used({"field"}), ConfigError);
  EXPECT_NO_THROW(options.check_used({"field"}, true));
  EXPECT_NO_THROW(options.check_used({"kdtree"}));
}

TEST(TrainingOptions, UnknownRenamedOrContradictingOnesAreRefused) {
  TrainingOptions options;
  EXPECT_THAT([&] { options.set("max_step", "3"); }, ThrowsMessage<ConfigError>(HasSubstr("max-steps")));
  EXPECT_THAT([&] { options.set("uniform", "0.1"); }, ThrowsMessage<ConfigError>(HasSubstr("uniform_share")));
  options.set("epp", "1");
  EXPECT_THAT([&] { options.set("examples", "3"); }, ThrowsMessage<ConfigError>("examples excludes epp"));
  TrainingOptions other;
  other.set("examples", "3");
  EXPECT_THAT([&] { other.set("epp", "1"); }, ThrowsMessage<ConfigError>("epp excludes examples"));
}

TEST(TrainingOptions, EveryRowIsUsedByAFamilyAndRefusesNonsense) {
  TrainSettings settings;
  std::set<std::string> names;
  for (const Option& option : training_option_table(settings)) {
    EXPECT_TRUE(names.insert(option.name).second) << option.name;
    EXPECT_FALSE(users_of(option, true).empty()) << option.name;
    EXPECT_FALSE(option.help.empty()) << option.name;
    for (const char* nonsense : {"nan", "1e300", "-1", "18446744073709551616", ""})
      EXPECT_THROW(option.set(nonsense, option.name), ConfigError) << option.name << " " << nonsense;
    // What is the default can be given.
    for (const OptionUse& use : option.uses) {
      const std::string value = use.value.get();
      EXPECT_NO_THROW(value.empty() ? void() : option.set(value, option.name)) << option.name;
    }
  }
}

}  // namespace
}  // namespace warpath
