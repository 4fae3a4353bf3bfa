#include "train/candidates.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>

#include "core/interrupt.h"
#include "path/primary_source.h"
#include "train/test_integrand.h"

namespace warpath {
namespace {

TEST(Candidates, HaveTheNumbersOfAUniformSource) {
  constexpr std::uint64_t kSeed = 5;
  const Layout layout = Layout::parse("film+bounce1+bounce2.light");
  const TestIntegrand integrand(5, 1, [](auto y, auto f) { f[0] = y[0]; });
  const Candidates candidates = gather_candidates(integrand, layout, kSeed, 3000);
  ASSERT_EQ(candidates.size(), 3000u);
  for (const std::uint64_t id : {0u, 1u, 2047u, 2048u, 2999u}) {
    const std::uint64_t ids[] = {kFirstCandidate + id};
    const std::uint32_t lanes[] = {0};
    UniformSource source(kSeed, ids);
    float y[5], u0, u1;
    candidates.primary_sample(id, y);
    source.draw({GroupKind::film}, lanes, nullptr, &u0, &u1, nullptr);
    EXPECT_EQ(y[0], u0);
    EXPECT_EQ(y[1], u1);
    source.draw({GroupKind::dir, 1}, lanes, nullptr, &u0, &u1, nullptr);
    EXPECT_EQ(y[2], u0);
    EXPECT_EQ(y[3], u1);
    source.draw({GroupKind::light, 2}, lanes, nullptr, &u0, nullptr, nullptr);
    EXPECT_EQ(y[4], u0);
    EXPECT_EQ(candidates.target[id], y[0]);  // what the integrand saw
  }
}

TEST(Candidates, TargetIsLuminanceOrMagnitude) {
  const Layout layout = Layout::parse("time");
  const TestIntegrand colour(1, 3, [](auto, auto f) {
    f[0] = 1;
    f[1] = 2;
    f[2] = 3;
  });
  EXPECT_NEAR(gather_candidates(colour, layout, 0, 1).target[0], 0.212671 + 2 * 0.715160 + 3 * 0.072169, 1e-6);
  const TestIntegrand negative(1, 1, [](auto, auto f) { f[0] = -4; });
  EXPECT_EQ(gather_candidates(negative, layout, 0, 1).target[0], 4);
}

TEST(Candidates, NonFiniteOnesAreZeroAndCounted) {
  const TestIntegrand integrand(1, 1, [](auto y, auto f) {
    f[0] = y[0] < 0.25 ? NAN : y[0] < 0.5 ? std::numeric_limits<double>::infinity() : 1.0;
  });
  const Candidates candidates = gather_candidates(integrand, Layout::parse("time"), 1, 10'000);
  std::uint64_t expected = 0;
  for (std::uint64_t id = 0; id < candidates.size(); ++id) {
    float y;
    candidates.primary_sample(id, &y);
    expected += y < 0.5f;
    EXPECT_EQ(candidates.target[id], y < 0.5f ? 0.0f : 1.0f);
  }
  EXPECT_GT(expected, 4000u);
  EXPECT_EQ(candidates.non_finite, expected);
}

TEST(Candidates, AreTheSameForAnyNumberOfThreads) {
  const TestIntegrand integrand = bump(4);
  const Layout layout = Layout::parse("film+bounce1");
  const auto with_threads = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return gather_candidates(integrand, layout, 3, 20'000).target;
  };
  EXPECT_EQ(with_threads(1), with_threads(2));
}

TEST(Candidates, TellTheirProgress) {
  std::uint64_t last = 0;
  gather_candidates(bump(2), Layout::parse("film"), 3, 10'000, [&](std::uint64_t done) {
    EXPECT_GT(done, last);
    last = done;
  });
  EXPECT_EQ(last, 10'000u);
}

TEST(Candidates, CanBeInterrupted) {
  EXPECT_THROW(
      gather_candidates(bump(2), Layout::parse("film"), 3, 1'000'000, [](std::uint64_t) { g_interrupted = true; }),
      Interrupted);
  g_interrupted = false;
}

}  // namespace
}  // namespace warpath
