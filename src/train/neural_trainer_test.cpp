#include "train/neural_trainer.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <cmath>
#include <vector>

#include "core/rng.h"
#include "core/tensor_file.h"
#include "core/vertex_context_buffer.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::size_t kBatch = 4096;

/// Diffuse vertices on a floor, x and z in [0,1): light comes from a quarter of the numbers that moves with x.
struct Batch {
  explicit Batch(std::uint64_t seed) {
    for (std::size_t i = 0; i < kBatch; ++i) {
      const std::uint64_t key = sample_key(seed, i);
      VertexValues values{};
      values[0] = sample_float(key, 10);
      values[2] = sample_float(key, 11);
      values[4] = values[12] = 1;
      buffer.add(values, static_cast<std::uint8_t>(SurfaceKind::diffuse), 0);
      for (std::uint32_t d = 0; d < kBounceDimensions; ++d) numbers[d].push_back(sample_float(key, d));
      lanes.push_back(static_cast<std::uint32_t>(i));
      light.push_back(lit(values[0], numbers[1][i]) ? 1.0f : 0.0f);
      beyond.push_back(lit(values[0], numbers[4][i]) ? 100.0f : 0.0f);
    }
  }
  static bool lit(float x, float y) { return std::fabs(y - x) < 0.125f; }
  VertexRecords records(std::uint16_t bounce = 1) const {
    VertexRecords r;
    r.bounce = bounce;
    r.lanes = lanes;
    r.context = buffer.view();
    for (std::size_t d = 0; d < kBounceDimensions; ++d) r.numbers[d] = numbers[d].data();
    r.inv_q_light = r.inv_q_scatter = ones.data();
    r.light = light.data();
    r.beyond = beyond.data();
    return r;
  }
  VertexContextBuffer buffer;
  std::vector<std::uint32_t> lanes;
  std::array<std::vector<float>, kBounceDimensions> numbers;
  std::vector<float> light, beyond, ones = std::vector<float>(kBatch, 1.0f);
};

NeuralSettings small() {
  NeuralSettings settings;
  settings.batch = 512;
  settings.rate = 5e-3;
  settings.min_visits = 1 << 16;
  settings.field.max_cells = 4;  // so coarse that the network has something to add
  return settings;
}

void teach(VertexTrainer& trainer, const Batch& batch, std::uint16_t bounce = 1) {
  const auto recorder = trainer.make_recorder();
  recorder->record(batch.records(bounce));
  trainer.merge(*recorder);
}

template <class Trainer>
auto taught(Trainer& trainer, int passes, int batches = 8) {
  for (int p = 0; p < passes; ++p) {
    for (int b = 0; b < batches; ++b) teach(trainer, Batch(static_cast<std::uint64_t>(p * batches + b)));
    if (p + 1 < passes) trainer.fit();
  }
  return trainer.fit();
}

/// Mean of ln q where light comes from, at vertices that nothing was learned from.
double gain(const VertexWarp& warp, VertexNumbers which) {
  const Batch batch(999);
  std::vector<std::uint32_t> places(kBatch * warp.place_size());
  warp.locate(batch.buffer.view(), kBatch, places.data());
  const std::size_t first = which == VertexNumbers::light ? 0 : 3;
  std::vector<float> inv_q(kBatch);
  warp.inverse_density(which, batch.buffer.view(), places.data(), kBatch,
                       {batch.numbers[first].data(), batch.numbers[first + 1].data(), batch.numbers[first + 2].data()},
                       inv_q.data());
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < kBatch; ++i) {
    if (!Batch::lit(batch.buffer.view().position[0][i], batch.numbers[first + 1][i])) continue;
    sum -= std::log(static_cast<double>(inv_q[i]));
    ++count;
  }
  return sum / count;
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
