#include "render/automatic.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

namespace warpath {
namespace {

using testing::ElementsAre;

/// Renders `spp` samples per pixel, where one sample drawn by "none" or "field" has its error. A warped path counts as
/// 1.85 plain ones.
struct Render {
  std::map<std::string, double> errors;  // of one sample
  std::map<int, double> later_errors{};  // from so many samples per pixel on, of whatever draws
  std::vector<PassRecord> passes{};
  std::string choice{};

  double error(const PassRecord& pass, int done) const {
    const auto later = later_errors.upper_bound(done);
    return later == later_errors.begin() ? errors.at(pass.drawn_by) : std::prev(later)->second;
  }
  void run(int spp) {
    Automatic automatic(Schedule(spp), "field", false);
    int done = 0;
    while (auto pass = automatic.plan(done)) {
      automatic.judge(*pass, {done, 1, 0, [&] { return error(*pass, done); }});
      passes.push_back(*pass);
      done += pass->spp;
    }
    choice = automatic.choice();
  }
  std::vector<std::string> drawn_by() const {
    std::vector<std::string> names;
    for (const PassRecord& pass : passes) names.push_back(pass.drawn_by);
    return names;
  }
  std::string chosen() const {
    std::string last;
    for (const PassRecord& pass : passes)
      if (!pass.chosen.empty()) last = pass.chosen;
    return last;
  }
};

TEST(Automatic, StartsWithUniformNumbersAndKeepsAWarpThatPays) {
  Render render{.errors = {{"none", 1}, {"field", 0.3}}};
  render.run(64);
  EXPECT_THAT(render.drawn_by(), ElementsAre("none", "none", "none", "none", "field", "field", "field"));
  EXPECT_EQ(render.chosen(), "field");
  EXPECT_NE(render.choice.find("field 1.80"), std::string::npos) << render.choice;  // 1 / (0.3 x 1.85)
}

TEST(Automatic, TeachesWhatItMayUse) {
  Render render{.errors = {{"none", 1}, {"field", 0.3}}};
  render.run(64);
  for (std::size_t p = 0; p < render.passes.size(); ++p)
    EXPECT_EQ(render.passes[p].teaches, p + 1 < render.passes.size()) << "the last pass has none to teach";
}

TEST(Automatic, GivesAWarpUpThatIsHopeless) {
  Render render{.errors = {{"none", 1}, {"field", 4}}};
  render.run(64);
  EXPECT_THAT(render.drawn_by(), ElementsAre("none", "none", "none", "none", "field", "none", "none"));
  EXPECT_EQ(render.chosen(), "none");
  EXPECT_FALSE(render.passes[5].teaches);
}

TEST(Automatic, GivesAWarpUpThatHasLearnedAndStillDoesNotPay) {
  Render render{.errors = {{"none", 1}, {"field", 1.6}}};
  render.run(128);
  EXPECT_THAT(render.drawn_by(), ElementsAre("none", "none", "none", "none", "field", "field", "field", "none"));
  EXPECT_EQ(render.chosen(), "none");
}

TEST(Automatic, StopsLearningWhenItGainsNothing) {
  Render learns{.errors = {{"none", 1}, {"field", 0.5}},
                .later_errors = {{64, 0.4}, {128, 0.3}, {256, 0.2}, {512, 0.1}}};
  learns.run(2048);
  EXPECT_TRUE(learns.passes[learns.passes.size() - 2].teaches);
  Render knows{.errors = {{"none", 1}, {"field", 0.5}}};
  knows.run(2048);
  EXPECT_FALSE(knows.passes[knows.passes.size() - 2].teaches);
  EXPECT_EQ(knows.passes.back().drawn_by, "field") << "what was learned stays in use";
  EXPECT_NE(knows.choice.find("learned from"), std::string::npos);
}

TEST(Automatic, MeasuresCostsByTheClockWhereItIsTold) {
  Automatic automatic(Schedule(std::chrono::duration<double>(1e6)), "field", true);
  int done = 0;
  // A sample per pixel takes a second, a warped one three, of which learning takes one: error x cost is 1 x 2.
  for (int p = 0; p < 5; ++p) {
    auto pass = automatic.plan(done);
    ASSERT_TRUE(pass);
    const bool warped = pass->drawn_by == "field";
    EXPECT_EQ(pass->teaches, done != 2) << "that pass shows what a path costs without a warp";
    automatic.judge(*pass,
                    {done, (warped ? 3.0 : 1.0) * pass->spp, warped ? 1.0 * pass->spp : 0.0, [] { return 1.0; }});
    done += pass->spp;
  }
  EXPECT_NE(automatic.choice().find("field 0.50"), std::string::npos) << automatic.choice();
}

}  // namespace
}  // namespace warpath
