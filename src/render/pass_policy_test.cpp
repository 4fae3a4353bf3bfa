#include "render/pass_policy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace warpath {
namespace {

using testing::ElementsAre;

std::vector<PassRecord> planned(PassPolicy& policy) {
  std::vector<PassRecord> passes;
  int done = 0;
  while (const auto pass = policy.plan(done)) {
    passes.push_back(*pass);
    done += pass->spp;
  }
  return passes;
}

std::vector<int> lengths(const std::vector<PassRecord>& passes) {
  std::vector<int> spp;
  for (const PassRecord& pass : passes) spp.push_back(pass.spp);
  return spp;
}

TEST(Fixed, DoublesWhatIsThereUntilAllIsRendered) {
  Fixed policy(Schedule(20), "field");
  const auto passes = planned(policy);
  EXPECT_THAT(lengths(passes), ElementsAre(1, 1, 2, 4, 8, 4));
  for (const PassRecord& pass : passes) EXPECT_EQ(pass.drawn_by, "field");
  EXPECT_FALSE(passes.back().teaches) << "there is none to draw with what it teaches";
  EXPECT_TRUE(passes[4].teaches);
}

TEST(Fixed, LearnsFromTheLastPassWhereTheWarpIsWanted) {
  Fixed policy(Schedule(3), "field", true);
  EXPECT_TRUE(planned(policy).back().teaches);
}

TEST(Fixed, KnowsHowMuchIsDone) {
  Fixed policy(Schedule(8), "none");
  PassRecord pass;
  pass.spp = 4;
  EXPECT_DOUBLE_EQ(policy.progress(pass, 4, 0.5), 0.75);
}

TEST(Schedule, TheFirstPassIsRenderedWhateverTheTime) {
  const Schedule none_left(std::chrono::duration<double>(-1));
  EXPECT_EQ(none_left.next(0)->spp, 1);
  EXPECT_FALSE(none_left.over(0));
  EXPECT_TRUE(none_left.over(1));
}

TEST(Schedule, WhatIsLeftOfTheTimeIsOnePassUnlessItDoublesAll) {
  Schedule schedule(std::chrono::duration<double>(1000));
  schedule.took(10);  // about a hundred samples per pixel more
  EXPECT_EQ(schedule.next(4)->spp, 4);
  EXPECT_FALSE(schedule.next(4)->last);
  const auto rest = schedule.next(64);
  EXPECT_NEAR(rest->spp, 99, 1);
  EXPECT_TRUE(rest->last);
  schedule.took(1e6);
  EXPECT_FALSE(schedule.next(1)) << "not one more fits";
}

TEST(Replayed, RepeatsEveryPassBatchByBatch) {
  PassRecord first, second;
  first.spp = 1;
  first.batches = 3;
  second.spp = 2;
  second.drawn_by = "field";
  Replayed policy({first, second});
  const auto passes = planned(policy);
  EXPECT_THAT(lengths(passes), ElementsAre(1, 2));
  EXPECT_EQ(passes[1].drawn_by, "field");
  EXPECT_FALSE(policy.ends(first, 0, 2));
  EXPECT_TRUE(policy.ends(first, 0, 3));
  EXPECT_DOUBLE_EQ(policy.progress(second, 1, 0.5), 2.0 / 3);
}

}  // namespace
}  // namespace warpath
