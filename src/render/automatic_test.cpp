#include "render/automatic.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

namespace warpath {
namespace {

using testing::ElementsAre;

/// Learns nothing; counts how often it was shown a pass and asked for its warp.
class FakeTrainer final : public VertexLearner {
 public:
  explicit FakeTrainer(int& lessons) : m_lessons(lessons) {}
  std::unique_ptr<VertexRecorder> make_recorder() const override { return std::make_unique<Recorder>(); }
  void merge(VertexRecorder&) override {}
  std::shared_ptr<const VertexProposal> fit() override {
    ++m_lessons;
    return nullptr;
  }

 private:
  struct Recorder final : VertexRecorder {
    void record(const VertexRecords&) override {}
  };
  int& m_lessons;
};

/// Renders `spp` samples per pixel, where one sample drawn by a method has its error.
struct Render {
  std::map<std::string, double> errors;  // of one sample; "" are uniform numbers
  std::map<std::string, int> lessons{};
  std::map<int, double> later_errors{};  // from so many samples per pixel on, of whatever draws
  std::vector<PassRecord> passes{};
  std::string choice{};

  std::vector<Contender> contenders() {
    std::vector<Contender> all;
    for (const char* name : {"field", "other"})
      if (errors.contains(name)) all.push_back({name, std::make_unique<FakeTrainer>(lessons[name]), 1.5, 100});
    return all;
  }
  double error(const PassRecord& pass, int done) const {
    const auto later = later_errors.upper_bound(done);
    return later == later_errors.begin() ? errors.at(pass.drawn_by) : std::prev(later)->second;
  }
  void run(int spp, double paths_per_spp = 1000) {
    Automatic automatic(contenders(), false);
    for (int done = 0; done < spp; done += passes.back().spp) {
      PassRecord pass;
      pass.spp = std::min(std::max(1, done), spp - done);
      pass.teaches = true;
      automatic.plan(pass, done);
      if (automatic.learner(pass)) automatic.fit(pass);
      const double left = spp - done - pass.spp;
      automatic.judge(pass, {done, error(pass, done), 1, paths_per_spp, left});
      passes.push_back(pass);
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
  Render render{.errors = {{"", 1}, {"field", 0.3}}};
  render.run(64);
  EXPECT_THAT(render.drawn_by(), ElementsAre("", "", "", "", "field", "field", "field"));
  EXPECT_EQ(render.chosen(), "field");
  EXPECT_EQ(render.lessons["field"], 7);
  EXPECT_NE(render.choice.find("field 2.22"), std::string::npos) << render.choice;  // 1 / (0.3 x 1.5)
}

TEST(Automatic, GivesAWarpUpThatDoesNotPay) {
  Render render{.errors = {{"", 1}, {"field", 4}}};
  render.run(64);
  EXPECT_THAT(render.drawn_by(), ElementsAre("", "", "", "", "field", "", ""));
  EXPECT_EQ(render.chosen(), "none");
  EXPECT_FALSE(render.passes.back().teaches);
}

TEST(Automatic, GivesAWarpUpThatHasLearnedAndStillDoesNotPay) {
  Render render{.errors = {{"", 1}, {"field", 1.6}}};
  render.run(128);
  EXPECT_THAT(render.drawn_by(), ElementsAre("", "", "", "", "field", "field", "field", ""));
  EXPECT_EQ(render.chosen(), "none");
}

TEST(Automatic, OthersAreTriedWhereThereIsTimeForThem) {
  Render render{.errors = {{"", 1}, {"field", 0.5}, {"other", 0.2}}};
  render.run(1024);
  EXPECT_EQ(render.chosen(), "other");
  EXPECT_EQ(render.passes[4].drawn_by, "field");
  EXPECT_EQ(render.passes[5].drawn_by, "other");
  EXPECT_EQ(render.passes[5].spp, 4);
  EXPECT_EQ(render.passes.back().drawn_by, "other");
  EXPECT_EQ(render.lessons["field"], 5) << "it learns no more once another is chosen";

  Render is_short{.errors = {{"", 1}, {"field", 0.5}, {"other", 0.2}}};
  is_short.run(128);
  EXPECT_EQ(is_short.chosen(), "field");
  Render small{.errors = {{"", 1}, {"field", 0.5}, {"other", 0.2}}};
  small.run(1024, 1);  // a fit takes as long as 100 paths, which is as long as 100 samples for each of its pixels
  EXPECT_EQ(small.chosen(), "field");
}

TEST(Automatic, TheFirstHasMoreToLearnThanOthers) {
  Render render{.errors = {{"", 1}, {"field", 0.5}, {"other", 0.4}}};
  render.run(1024);
  EXPECT_EQ(render.chosen(), "field");
}

TEST(Automatic, OthersMustPayAtOnce) {
  Render render{.errors = {{"", 1}, {"field", 2}, {"other", 0.8}}, .later_errors = {{30, 0.3}}};
  render.run(1024);
  EXPECT_EQ(render.passes[5].drawn_by, "other");
  EXPECT_EQ(render.chosen(), "field") << "which has learned since";
}

TEST(Automatic, StopsLearningWhenItGainsNothing) {
  Render learns{.errors = {{"", 1}, {"field", 0.5}}, .later_errors = {{64, 0.4}, {128, 0.3}, {256, 0.2}, {512, 0.1}}};
  learns.run(2048);
  EXPECT_TRUE(learns.passes[learns.passes.size() - 2].teaches);
  Render knows{.errors = {{"", 1}, {"field", 0.5}}};
  knows.run(2048);
  EXPECT_FALSE(knows.passes.back().teaches);
  EXPECT_EQ(knows.passes.back().drawn_by, "field") << "what was learned stays in use";
  EXPECT_NE(knows.choice.find("learned from"), std::string::npos);
}

TEST(Automatic, ReplaysWhatWasRecorded) {
  Render render{.errors = {{"", 1}, {"field", 0.5}, {"other", 0.2}}};
  render.run(1024);
  Render again{.errors = render.errors};
  Automatic automatic(again.contenders(), true);
  automatic.start_replay(render.passes);
  for (const PassRecord& pass : render.passes) {
    if (automatic.learner(pass)) automatic.fit(pass);
    automatic.replay(pass);
  }
  EXPECT_EQ(again.lessons, render.lessons);
}

}  // namespace
}  // namespace warpath
