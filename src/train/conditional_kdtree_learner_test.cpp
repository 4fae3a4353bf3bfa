#include "train/conditional_kdtree_learner.h"

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

ConditionalKdTreeSettings small() {
  ConditionalKdTreeSettings settings;
  settings.numbers = Layout::parse("bounce1.light+bounce1.light_uv+bounce1.lobe+bounce1");
  settings.tiles = 8;
  return settings;
}

ConditionalKdTreeLearner learner_of(const ConditionalKdTreeSettings& settings, double uniform = kUniform) {
  return ConditionalKdTreeLearner(settings, 64, 48, uniform);
}

// Light comes from a quarter of the numbers, which moves with the place on the film: a density that does not know the
// place can gain no more than ln 4 / 3, one that does ln 3.7 with a tenth of uniform numbers.
TEST(ConditionalKdTreeLearner, LearnsWhatMovesWithThePlaceOnTheFilm) {
  auto learner = learner_of(small());
  const auto tree = taught(learner, 4);
  for (const auto which : kBoth) EXPECT_GT(gain(*tree, which), 0.8);
}

TEST(ConditionalKdTreeLearner, SameBitsForAnyNumberOfThreads) {
  std::vector<std::vector<float>> splits;
  for (const std::size_t threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    auto learner = learner_of(small());
    TensorFile file;
    taught(learner, 3, 4)->save(file, "");
    splits.push_back(file.get<float>("scatter.z_split").values);
  }
  EXPECT_GT(splits[0].size(), 100u);
  EXPECT_EQ(splits[0], splits[1]);
  EXPECT_EQ(splits[0], splits[2]);
}

TEST(ConditionalKdTreeLearner, LearnsTheNumbersThatItIsToWarp) {
  ConditionalKdTreeSettings settings = small();
  settings.numbers = Layout::parse("bounce2.lobe+bounce2");
  auto learner = learner_of(settings);
  for (int b = 0; b < 8; ++b) teach(learner, Batch(static_cast<std::uint64_t>(b)), 1);
  EXPECT_NEAR(gain(*learner.fit_trees(), VertexDecision::scattering), 0, 1e-6) << "nothing was seen of bounce 2";
  for (int b = 0; b < 8; ++b) teach(learner, Batch(static_cast<std::uint64_t>(b)), 2);
  const auto tree = learner.fit_trees();
  EXPECT_GT(gain(*tree, VertexDecision::scattering), 0.5);
  EXPECT_NEAR(gain(*tree, VertexDecision::light_sampling), 0, 1e-6);
  EXPECT_TRUE(tree->warps(VertexDecision::scattering, 2));
  EXPECT_FALSE(tree->warps(VertexDecision::scattering, 1));
}

// Only ratios of what comes back matter, however bright the lights are.
TEST(ConditionalKdTreeLearner, TheUnitOfLightDoesNotMatter) {
  std::vector<double> gains;
  for (const float unit : {1.0f, 0x1p80f, 0x1p-80f}) {
    auto learner = learner_of(small());
    for (std::uint64_t b = 0; b < 8; ++b) {
      Batch batch(b);
      for (float& returned : batch.scatter_return) returned *= unit;
      teach(learner, batch);
    }
    gains.push_back(gain(*learner.fit_trees(), VertexDecision::scattering));
  }
  EXPECT_GT(gains[0], 0.5);
  EXPECT_EQ(gains[0], gains[1]);
  EXPECT_EQ(gains[0], gains[2]);
}

// What is learned from those examples that there is room for is what all of them would teach, if less of it.
TEST(ConditionalKdTreeLearner, LearnsFromTheExamplesThatFit) {
  ConditionalKdTreeSettings settings = small();
  settings.most_examples = 20'000;
  auto learner = learner_of(settings);
  const auto tree = taught(learner, 4);
  for (const auto which : kBoth) EXPECT_GT(gain(*tree, which), 0.5);
}

// Numbers drawn by a density that has learned teach the same as uniform ones: what they bring comes with 1 / q.
TEST(ConditionalKdTreeLearner, NumbersOfAnyDensityTeach) {
  auto uniform = learner_of(small()), skewed = learner_of(small());
  for (int b = 0; b < 24; ++b) {
    Batch batch(static_cast<std::uint64_t>(b));
    teach(uniform, batch);
    // The second number is y^2 with y uniform: q = 1 / (2 sqrt(u)).
    std::vector<float> inv_q;
    for (std::size_t i = 0; i < test::kBatch; ++i) {
      const float y = batch.numbers[4][i], x = batch.buffer.view().position[0][i];
      batch.numbers[4][i] = y * y;
      inv_q.push_back(2 * y);
      batch.scatter_return[i] = Batch::lit(x, y * y) ? 100 * 2 * y : 0.0f;
    }
    VertexRecords records = batch.records();
    records.inv_q_scatter = inv_q.data();
    const auto recorder = skewed.make_recorder();
    recorder->record(records);
    skewed.merge(*recorder);
  }
  const double of_uniform = gain(*uniform.fit_trees(), VertexDecision::scattering);
  EXPECT_NEAR(gain(*skewed.fit_trees(), VertexDecision::scattering), of_uniform, 0.1 * of_uniform);
}

TEST(ConditionalKdTreeLearner, ValuesThatAreNotFiniteTeachNothing) {
  auto learner = learner_of(small());
  for (std::uint64_t b = 0; b < 8; ++b) {
    Batch batch(b);
    std::fill(batch.scatter_return.begin(), batch.scatter_return.end(), std::nanf(""));
    std::fill(batch.light.begin(), batch.light.end(), INFINITY);
    teach(learner, batch);
  }
  const auto tree = learner.fit_trees();
  for (const auto which : kBoth) EXPECT_NEAR(gain(*tree, which), 0, 1e-6);
}

TEST(ConditionalKdTreeLearner, SettingsThatMakeNoSense) {
  const auto refused = [](auto change, double uniform = kUniform) {
    ConditionalKdTreeSettings settings = small();
    change(settings);
    EXPECT_THROW(learner_of(settings, uniform), ConfigError);
  };
  refused([](auto& settings) { settings.tiles = 0; });
  refused([](auto& settings) { settings.tilings = 0; });
  refused([](auto& settings) { settings.tilings = 9; });
  refused([](auto& settings) { settings.most_examples = 0; });
  refused([](auto& settings) { settings.numbers = Layout::parse("bounce1"); });
  refused([](auto& settings) { settings.numbers = Layout::parse("bounce1.lobe+bounce1+bounce2.lobe+bounce2"); });
  refused([](auto& settings) { settings.numbers = {}; });
  refused([](auto&) {}, 1.0);
}

}  // namespace
}  // namespace warpath
