#include "family/fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "core/rng.h"
#include "family/warp_file.h"
#include "train/fit_fixture.h"
#include "warp/check.h"
#include "warp/uniform.h"
#include "warpath/error.h"

namespace warpath {
namespace {

TrainSettings quick() {
  TrainSettings settings;
  settings.examples = 20'000;
  settings.alpha = 4;
  settings.realnvp.couplings = 4;
  settings.realnvp.width = 16;
  settings.realnvp.max_steps = 100;
  settings.spline.couplings = 2;
  settings.spline.width = 16;
  settings.spline.max_steps = 100;
  return settings;
}

class FitFamilyTest : public testing::TestWithParam<const char*> {};

TEST_P(FitFamilyTest, FitsMixesAndKeepsEveryPromise) {
  for (const int dims : {1, 2, 4, 7}) {
    const TrainSettings settings = quick();
    const Family& family = *find_family(GetParam());
    const Layout layout = layout_of(dims);
    const Candidates candidates = gather_candidates(bump(dims), layout, 1, candidate_count(settings));
    const Fit fit = warpath::fit(*family.joint(), candidates, settings);
    const bool flow = family.joint()->is_flow;
    CheckOptions options;
    options.log_q_tolerance = flow ? 1e-3 : 1e-9;
    EXPECT_EQ(check_proposal(*fit.proposal, options), "");
    EXPECT_EQ(fit.proposal->dims(), dims);
    EXPECT_FALSE(fit.log.stopped.empty());
    if (family.learns()) {
      EXPECT_EQ(fit.proposal->family(), "mixture");
      ASSERT_FALSE(fit.log.points.empty());
      if (dims == 1 && family.name == "realnvp") continue;  // a coupling has nothing to look at
      // Better than the uniform density: -ln q, or where a flow starts, ln E[g / q].
      EXPECT_LT(fit.log.points.back().held_out, flow ? fit.log.points.front().held_out : 0.0);
      EXPECT_LT(second_moment(bump(dims), *fit.proposal), 0.8 * second_moment(bump(dims), Uniform(dims)));
    }
  }
}

TEST_P(FitFamilyTest, TrainedWarpsCanBeStored) {
  const TrainSettings settings = quick();
  const Layout layout = Layout::parse("film+bounce1");
  const Candidates candidates = gather_candidates(bump(4), layout, 1, candidate_count(settings));
  const Fit fit = warpath::fit(joint_family(GetParam()), candidates, settings);
  const auto path = std::filesystem::temp_directory_path() / fmt::format("warpath-{}-{}.warp", GetParam(), ::getpid());
  save_warp(path, {fit.proposal, nullptr, layout, "a scene", {{"seed", "0"}}});
  const WarpFile loaded = load_warp(path);
  EXPECT_EQ(loaded.layout, layout);
  EXPECT_EQ(loaded.scene, "a scene");
  EXPECT_EQ(loaded.settings.at("seed"), "0");
  EXPECT_EQ(loaded.proposal->family(), fit.proposal->family());
  Matrix<double> y(1000, 4);
  for (std::size_t k = 0; k < y.values().size(); ++k) y.values()[k] = sample_double(sample_key(1, k), 0);
  std::vector<double> before(1000), after(1000);
  fit.proposal->log_density(y.batch(), before);
  loaded.proposal->log_density(y.batch(), after);
  EXPECT_EQ(before, after);
  std::filesystem::remove(path);
}

INSTANTIATE_TEST_SUITE_P(Families, FitFamilyTest, testing::Values("uniform", "grid", "kdtree", "realnvp", "spline"),
                         [](const auto& test) { return std::string(test.param); });

TEST(LoadProposal, SuggestsTheFamilyThatMayBeMeant) {
  TensorFile file;
  Uniform(2).save(file, "a.");
  EXPECT_EQ(load_proposal(file, "a.")->family(), "uniform");
  file.metadata()["a.family"] = "unifrom";
  EXPECT_THAT([&] { load_proposal(file, "a."); },
              testing::ThrowsMessage<FileError>(testing::HasSubstr("did you mean \"uniform\"?")));
  file.metadata()["a.family"] = "field";
  EXPECT_THROW(load_proposal(file, "a."), FileError) << "a warp of vertices is no proposal";
}

TEST(FitFamily, HandsOutTheBareWarpOnRequest) {
  TrainSettings settings = quick();
  settings.uniform_share = 0;
  const Candidates candidates = gather_candidates(bump(2), layout_of(2), 1, candidate_count(settings));
  EXPECT_EQ(fit(joint_family("kdtree"), candidates, settings).proposal->family(), "kdtree");
}

TEST(FitFamily, GivesTheUniformProposalWhereThereIsNoLight) {
  const TestIntegrand dark(2, 1, [](auto, auto f) { f[0] = 0; });
  const Candidates candidates = gather_candidates(dark, layout_of(2), 1, 1000);
  for (const char* family : {"grid", "kdtree", "realnvp", "spline"}) {
    const Fit fit = warpath::fit(joint_family(family), candidates, quick());
    EXPECT_EQ(fit.proposal->family(), "uniform");
    EXPECT_EQ(fit.log.stopped, "no candidate has any light");
  }
}

TEST(FitFamily, CanStartFromAMixture) {
  const TrainSettings settings = quick();
  const Candidates candidates = gather_candidates(bump(2), layout_of(2), 1, candidate_count(settings));
  const JointFamily& grid = joint_family("grid");
  const Fit first = fit(grid, candidates, settings);
  EXPECT_EQ(fit(grid, candidates, settings, first.proposal.get()).proposal->family(), "mixture");
  EXPECT_THROW(fit(joint_family("kdtree"), candidates, settings, first.proposal.get()), ConfigError);
}

TEST(FitFamily, FlowsLearnFromChunksAsFromOnePiece) {
  // Not the same numbers, since the first chunk tells how many examples there will be, but as good a density.
  const TestIntegrand integrand = bump(2);
  const Layout layout = layout_of(2);
  constexpr std::uint64_t kCount = 40'000;
  for (const char* family : {"realnvp", "spline"}) {
    const TrainSettings settings = quick();
    const Candidates whole = gather_candidates(integrand, layout, 1, kCount);
    const Fit piece = fit(joint_family(family), whole, settings);
    std::vector<float> seen;
    const Fit chunks = fit_in_chunks(
        joint_family(family), layout, kCount,
        [&](const auto& take) {
          for (std::uint64_t first = 0; first < kCount; first += kCount / 4) {
            const Candidates chunk = gather_candidates(integrand, layout, 1, kCount / 4, {}, false, first);
            seen.insert(seen.end(), chunk.target.begin(), chunk.target.end());
            take(chunk);
          }
        },
        settings);
    EXPECT_EQ(seen, whole.target) << "chunks are the same candidates";
    const double learned = second_moment(integrand, *piece.proposal);
    EXPECT_LT(learned, 0.8 * second_moment(integrand, Uniform(2))) << family;
    EXPECT_NEAR(second_moment(integrand, *chunks.proposal), learned, 0.1 * learned) << family;
  }
}

TEST(FitFamily, SettingsThatMakeNoSenseAreRefused) {
  const Candidates candidates = gather_candidates(bump(2), layout_of(2), 1, 1000);
  EXPECT_THAT([&] { joint_family("kdtee"); },
              testing::ThrowsMessage<ConfigError>("unknown warp family \"kdtee\"; did you mean \"kdtree\"?"));
  TrainSettings settings = quick();
  settings.uniform_share = 1;
  EXPECT_THROW(fit(joint_family("kdtree"), candidates, settings), ConfigError);
  EXPECT_THROW(fit(joint_family("grid"), candidates, quick(), std::make_shared<Uniform>(3).get()), ConfigError);
  settings.alpha = 0;
  EXPECT_THROW(candidate_count(settings), ConfigError);
  settings.alpha = 8;
  settings.examples = 512'000;
  EXPECT_EQ(candidate_count(settings), 4'096'000u);
}

}  // namespace
}  // namespace warpath
