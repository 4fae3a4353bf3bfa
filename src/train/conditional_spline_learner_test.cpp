#include "train/conditional_spline_learner.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <cmath>
#include <vector>

#include "core/tensor_file.h"
#include "train/vertex_learner_fixture.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using test::Batch, test::gain, test::taught, test::teach;

constexpr std::array kBoth{VertexDecision::light_sampling, VertexDecision::scattering};
constexpr double kUniform = 0.1;

ConditionalSplineSettings small() {
  ConditionalSplineSettings settings;
  settings.numbers = Layout::parse("bounce1.light+bounce1.light_uv+bounce1.lobe+bounce1");
  settings.flow.batch = 512;
  settings.flow.average = 0.98;
  settings.min_visits = 1 << 16;
  return settings;
}

// Light comes from a quarter of the numbers, which moves with the place: a density that does not know the place can
// gain no more than ln 4 / 3, one that does ln 3.7 with a tenth of uniform numbers.
TEST(ConditionalSplineLearner, LearnsWhatMovesWithThePlace) {
  for (const auto loss : {FlowTraining::Loss::variance, FlowTraining::Loss::likelihood}) {
    ConditionalSplineSettings settings = small();
    settings.flow.loss = loss;
    ConditionalSplineLearner learner(settings, kUniform, 1);
    const auto spline = taught(learner, 4);
    for (const auto which : kBoth) EXPECT_GT(gain(*spline, which), 0.9);
  }
}

TEST(ConditionalSplineLearner, SameBitsForAnyNumberOfThreads) {
  std::vector<std::vector<float>> weights;
  for (const std::size_t threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    ConditionalSplineLearner learner(small(), kUniform, 1);
    TensorFile file;
    taught(learner, 3, 2)->save(file, "");
    weights.push_back(file.get<float>("scatter.coupling1.layer0.weight").values);
  }
  EXPECT_EQ(weights[0], weights[1]);
  EXPECT_EQ(weights[0], weights[2]);
}

TEST(ConditionalSplineLearner, LearnsTheNumbersThatItIsToWarp) {
  ConditionalSplineSettings settings = small();
  settings.numbers = Layout::parse("bounce2.lobe+bounce2");
  ConditionalSplineLearner learner(settings, kUniform, 1);
  teach(learner, Batch(1), 1);
  EXPECT_NEAR(gain(*learner.fit_flows(), VertexDecision::scattering), 0, 1e-5) << "nothing was seen of bounce 2";
  for (int pass = 0; pass < 3; ++pass) {
    for (int b = 0; b < 8; ++b) teach(learner, Batch(static_cast<std::uint64_t>(8 * pass + b)), 2);
    learner.fit_flows();
  }
  const auto spline = learner.fit_flows();
  EXPECT_GT(gain(*spline, VertexDecision::scattering), 0.5);
  EXPECT_NEAR(gain(*spline, VertexDecision::light_sampling), 0, 1e-5);
  EXPECT_TRUE(spline->warps(VertexDecision::scattering, 2));
  EXPECT_FALSE(spline->warps(VertexDecision::scattering, 1));
  EXPECT_FALSE(spline->warps(VertexDecision::light_sampling, 2));
}

// With room for a few examples only, those that stay stand for the others.
TEST(ConditionalSplineLearner, LearnsFromTheExamplesThatFit) {
  ConditionalSplineSettings settings = small();
  settings.most_examples = 2048;
  ConditionalSplineLearner learner(settings, kUniform, 1);
  const auto spline = taught(learner, 4);
  for (const auto which : kBoth) EXPECT_GT(gain(*spline, which), 0.6);
}

TEST(ConditionalSplineLearner, ValuesThatAreNotFiniteTeachNothing) {
  ConditionalSplineLearner learner(small(), kUniform, 1);
  Batch batch(1);
  std::fill(batch.scatter_return.begin(), batch.scatter_return.end(), std::nanf(""));
  std::fill(batch.light.begin(), batch.light.end(), INFINITY);
  for (int pass = 0; pass < 3; ++pass) {
    teach(learner, batch);
    EXPECT_NEAR(gain(*learner.fit_flows(), VertexDecision::light_sampling), 0, 1e-5);
  }
}

TEST(ConditionalSplineLearner, SettingsThatMakeNoSense) {
  const auto refused = [](auto change, double uniform = kUniform) {
    ConditionalSplineSettings settings = small();
    change(settings);
    EXPECT_THROW(ConditionalSplineLearner(settings, uniform, 1), ConfigError);
  };
  refused([](auto& settings) { settings.flow.batch = 32; });
  refused([](auto& settings) { settings.flow.width = 17; });
  refused([](auto& settings) { settings.most_examples = 0; });
  refused([](auto& settings) { settings.numbers = Layout::parse("bounce1"); });
  refused([](auto& settings) { settings.numbers = {}; });
  refused([](auto&) {}, 1.0);
}

}  // namespace
}  // namespace warpath
