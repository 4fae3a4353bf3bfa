#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/commands.h"
#include "family/family.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

std::optional<Command> parse(std::vector<const char*> words) {
  words.insert(words.begin(), "warpath");
  return parse_command_line(static_cast<int>(words.size()), words.data());
}

TEST(CommandLine, PutsOptionsWhereTheyBelong) {
  const auto command = std::get<RenderCommand>(
      *parse({"render", "a.xml",       "--size", "32x24",     "--crop",    "1,2,3,4", "--spp",
              "7",      "--objective", "even",   "--sampler", "sobol",     "--seed",  "18446744073709551615",
              "-D",     "a=b",         "--warp", "field",     "--threads", "3"}));
  EXPECT_EQ(command.scene.file, "a.xml");
  EXPECT_EQ(command.scene.size, (std::array{32, 24}));
  EXPECT_EQ(command.scene.crop, (std::array{1, 2, 3, 4}));
  EXPECT_EQ(command.render.spp, 7);
  EXPECT_FALSE(command.render.objective);
  EXPECT_EQ(command.render.sampler, Sampler::sobol);
  EXPECT_EQ(command.render.seed, std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(command.process.threads, 3);
  EXPECT_EQ(command.warp, "field");
}

TEST(CommandLine, RefusesValuesThatAreNone) {
  const std::vector<std::vector<const char*>> wrong{{"--time", "nan"},
                                                    {"--time", "-1"},
                                                    {"--time", "0"},
                                                    {"--time", "1e300"},
                                                    {"--seed", "-1"},
                                                    {"--spp", "0"},
                                                    {"--crop", "2147483647,0,1,1"},
                                                    {"--crop", "0,0,1"},
                                                    {"--size", "32"},
                                                    {"--size", "0x1"},
                                                    {"--threads", "0"},
                                                    {"--threads", "2147483647"},
                                                    {"--max-depth", "-1"},
                                                    {"--examples", "18446744073709551615"},
                                                    {"--epp", "1e300"},
                                                    {"--rate", "nan"},
                                                    {"--width", "0"},
                                                    {"--uniform", "0.1"},
                                                    {"-D", "=3"}};
  for (const auto& words : wrong) {
    std::vector<const char*> all{"render", "a.xml"};
    all.insert(all.end(), words.begin(), words.end());
    EXPECT_THROW(parse(all), ConfigError) << words[0] << " " << words[1];
  }
  EXPECT_THROW(parse({"render", "a.xml", "--spp", "1", "--time", "1"}), ConfigError);
}

TEST(CommandLine, HelpListsEveryFamilyThatIsRegistered) {
  register_family({"listed", "a family of this test", JointFamily{.load = nullptr, .most_dims = 1}});
  testing::internal::CaptureStdout();
  EXPECT_FALSE(parse({"render", "--help"}));
  EXPECT_THAT(testing::internal::GetCapturedStdout(), HasSubstr("listed"));
}

}  // namespace
}  // namespace warpath
