#include "train/neural_trainer.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <cmath>
#include <vector>

#include "core/tensor_file.h"
#include "train/vertex_trainer_fixture.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using test::Batch, test::gain, test::taught, test::teach;

NeuralSettings small() {
  NeuralSettings settings;
  settings.batch = 512;
  settings.rate = 5e-3;
  settings.min_visits = 1 << 16;
  settings.field.max_cells = 4;  // so coarse that the network has something to add
  return settings;
}

TEST(NeuralTrainer, AddsToACoarseFieldWhatVariesWithinItsCells) {
  FieldTrainer field_trainer(small().field, 1);
  NeuralTrainer trainer(small(), 1, 1);
  const auto field = taught(field_trainer, 6);
  const auto neural = taught(trainer, 6);
  for (const auto which : {VertexNumbers::light, VertexNumbers::scatter})
    EXPECT_GT(gain(*neural, which), gain(*field, which) + 0.15) << gain(*field, which);
}

// One pass teaches the field; the network needs data that the field has not seen.
TEST(NeuralTrainer, AfterOnePassItIsTheField) {
  FieldTrainer field_trainer(small().field, 1);
  NeuralTrainer trainer(small(), 1, 1);
  const auto field = taught(field_trainer, 1);
  const auto neural = taught(trainer, 1);
  for (const auto which : {VertexNumbers::light, VertexNumbers::scatter})
    EXPECT_NEAR(gain(*neural, which), gain(*field, which), 1e-5);
}

TEST(NeuralTrainer, SameBitsForAnyNumberOfThreads) {
  std::vector<std::vector<float>> networks;
  for (const std::size_t threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    NeuralTrainer trainer(small(), 1, 1);
    TensorFile file;
    taught(trainer, 3, 2)->save(file, "");
    networks.push_back(file.get<float>("network").values);
  }
  EXPECT_EQ(networks[0], networks[1]);
  EXPECT_EQ(networks[0], networks[2]);
}

TEST(NeuralTrainer, LearnsTheNumbersThatItIsToWarp) {
  NeuralSettings settings = small();
  settings.numbers = Layout::parse("bounce2.lobe+bounce2");
  NeuralTrainer trainer(settings, 1, 1);
  for (int pass = 0; pass < 3; ++pass) {
    teach(trainer, Batch(static_cast<std::uint64_t>(pass)), 1);
    EXPECT_NEAR(gain(*trainer.fit(), VertexNumbers::scatter), 0, 1e-5) << "nothing was seen of bounce 2";
  }
  for (int pass = 0; pass < 3; ++pass) {
    for (int b = 0; b < 8; ++b) teach(trainer, Batch(static_cast<std::uint64_t>(8 * pass + b)), 2);
    trainer.fit();
  }
  const auto neural = trainer.fit();
  EXPECT_GT(gain(*neural, VertexNumbers::scatter), 0.3);
  EXPECT_TRUE(neural->warps(VertexNumbers::scatter, 2));
  EXPECT_FALSE(neural->warps(VertexNumbers::scatter, 1));
  EXPECT_FALSE(neural->warps(VertexNumbers::light, 2));
}

TEST(NeuralTrainer, ValuesThatAreNotFiniteTeachNothing) {
  NeuralTrainer trainer(small(), 1, 1);
  Batch batch(1);
  std::fill(batch.beyond.begin(), batch.beyond.end(), std::nanf(""));
  std::fill(batch.light.begin(), batch.light.end(), INFINITY);
  for (int pass = 0; pass < 3; ++pass) {
    teach(trainer, batch);
    EXPECT_NEAR(gain(*trainer.fit(), VertexNumbers::light), 0, 1e-5);
  }
}

TEST(NeuralTrainer, SettingsThatMakeNoSense) {
  NeuralSettings settings = small();
  settings.batch = 32;
  EXPECT_THROW(NeuralTrainer(settings, 1, 1), ConfigError);
  settings = small();
  settings.width = 17;
  EXPECT_THROW(NeuralTrainer(settings, 1, 1), ConfigError);
  settings = small();
  settings.numbers = Layout::parse("bounce1");
  EXPECT_THROW(NeuralTrainer(settings, 1, 1), ConfigError);
}

}  // namespace
}  // namespace warpath
