#include "train/field_learner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/rng.h"
#include "warpath/error.h"

namespace warpath {
namespace {

/// Diffuse vertices on a floor, x and z in [0,1): what comes back lies in a corner of the numbers that depends on x.
struct Batch {
  Batch(std::uint64_t seed, std::size_t n)
      : lanes(n), material(n), kind(n), light(n), scatter_return(n), ones(n, 1), zeros(n) {
    for (auto& values : floats) values.assign(n, 0);
    for (auto& values : numbers) values.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint64_t key = sample_key(seed, i);
      lanes[i] = static_cast<std::uint32_t>(i);
      kind[i] = static_cast<std::uint8_t>(SurfaceKind::diffuse);
      floats[0][i] = sample_float(key, 10);
      floats[2][i] = sample_float(key, 11);
      floats[4][i] = 1;  // normal
      for (std::uint32_t d = 0; d < kBounceDimensions; ++d) numbers[d][i] = sample_float(key, d);
      const bool left = floats[0][i] < 0.5f;
      light[i] = (numbers[1][i] < 0.25f) == left ? 1.0f : 0.1f;
      scatter_return[i] = numbers[4][i] < 0.5f && numbers[5][i] < 0.5f ? (numbers[6][i] < 0.5f ? 6.0f : 0.0f) : 1.0f;
    }
  }
  VertexContext context() const {
    VertexContext c;
    for (std::size_t k = 0; k < 3; ++k) {
      c.position[k] = floats[k].data();
      c.normal[k] = floats[3 + k].data();
      c.wi[k] = floats[6 + k].data();
    }
    c.kind = kind.data();
    c.material = material.data();
    return c;
  }
  VertexRecords records() const {
    VertexRecords r;
    r.bounce = 1;
    r.lanes = lanes;
    r.context = context();
    for (std::size_t d = 0; d < kBounceDimensions; ++d) r.numbers[d] = numbers[d].data();
    r.inv_q_light = r.inv_q_scatter = ones.data();
    r.light_return = light.data();
    r.scatter_return = scatter_return.data();
    return r;
  }
  std::vector<std::uint32_t> lanes, material;
  std::vector<std::uint8_t> kind;
  std::array<std::vector<float>, 9> floats;
  std::array<std::vector<float>, kBounceDimensions> numbers;
  std::vector<float> light, scatter_return, ones, zeros;
};

constexpr std::size_t kBatch = 4096;

void teach(FieldLearner& learner, const Batch& batch) {
  const auto recorder = learner.make_recorder();
  recorder->record(batch.records());
  learner.merge(*recorder);
}

std::shared_ptr<const Field> taught(const FieldSettings& settings, int batches) {
  FieldLearner learner(settings, 1);
  std::shared_ptr<const Field> field;
  for (int b = 0; b < batches; ++b) {
    teach(learner, Batch(static_cast<std::uint64_t>(b), kBatch));
    if (b % 8 == 7) field = learner.fit_field();
  }
  return learner.fit_field();
}

/// q of numbers at one of the vertices of a batch.
float density(const Field& field, VertexDecision which, const Batch& batch, std::size_t i, std::array<float, 3> y) {
  const VertexContext context = batch.context().from(i);
  std::uint32_t place;
  field.locate(context, 1, &place);
  float inv_q;
  field.inverse_density(which, context, &place, 1, {&y[0], &y[1], &y[2]}, &inv_q);
  return 1 / inv_q;
}

TEST(FieldLearner, DensityGoesWithTheMean) {
  const Batch batch(1, 1);
  // On a quarter of the square of directions `scatter_return` is 6 or 0, with mean 3; elsewhere it is 1.
  FieldSettings settings;
  settings.max_cells = 1;
  settings.first_uniform_share = 0.1;
  const auto field = taught(settings, 100);
  const double value = 3, mean = 0.25 * value + 0.75;
  // Mean of q over a quarter of the square: bins differ, probabilities are rounded.
  const auto q = [&](float u0, float v0) {
    double sum = 0;
    for (float u = 1 / 32.0f; u < 0.5f; u += 1 / 16.0f)
      for (float v = 1 / 32.0f; v < 0.5f; v += 1 / 16.0f)
        sum += density(*field, VertexDecision::scattering, batch, 0, {0.5f, u0 + u, v0 + v}) / 64;
    return sum;
  };
  // Every node gives up to 16 of its 240 units away evenly.
  EXPECT_NEAR(q(0.0f, 0.0f), 0.1 + 0.9 * value / mean, 0.15);
  EXPECT_NEAR(q(0.0f, 0.5f), 0.1 + 0.9 / mean, 0.1);
  EXPECT_NEAR(q(0.5f, 0.5f), 0.1 + 0.9 / mean, 0.1);
}

TEST(FieldLearner, CellsTellPlacesApart) {
  FieldSettings settings;
  settings.split_at = 5000;
  settings.first_uniform_share = 0.1;
  const auto field = taught(settings, 100);
  EXPECT_GT(field->tree().cells(), 40u);
  EXPECT_LT(field->tree().cells(), 200u);
  const Batch batch(1, 200);
  for (std::size_t i = 0; i < 200; ++i) {
    if (std::fabs(batch.floats[0][i] - 0.5f) < 0.1f) continue;  // cells that reach over the border know both sides
    const bool left = batch.floats[0][i] < 0.5f;
    const float low = density(*field, VertexDecision::light_sampling, batch, i, {0.5f, 0.1f, 0.5f});
    const float high = density(*field, VertexDecision::light_sampling, batch, i, {0.5f, 0.8f, 0.5f});
    EXPECT_TRUE(left ? low > 2.5f * high : high > 2.5f * low) << low << " " << high << " at " << batch.floats[0][i];
  }
}

/// By draws of the field itself: a quarter of the square brings 5; the rest `rare` once in so many draws, else nothing.
std::shared_ptr<const Field> taught_by_its_own_draws(float rare) {
  FieldSettings settings;
  settings.max_cells = 1;
  FieldLearner learner(settings, 1);
  auto field = (teach(learner, Batch(99, kBatch)), learner.fit_field());
  for (std::uint64_t pass = 0; pass < 8; ++pass) {
    Batch batch(100 + pass, kBatch);
    std::vector<float> inv_q(kBatch);
    std::vector<std::uint32_t> places(kBatch);
    std::array<std::vector<double>, 3> z;
    for (std::size_t a = 0; a < 3; ++a) z[a].assign(batch.numbers[3 + a].begin(), batch.numbers[3 + a].end());
    field->locate(batch.context(), kBatch, places.data());
    field->sample(VertexDecision::scattering, batch.context(), places.data(), kBatch,
                  {z[0].data(), z[1].data(), z[2].data()},
                  {batch.numbers[3].data(), batch.numbers[4].data(), batch.numbers[5].data()}, inv_q.data());
    for (std::size_t i = 0; i < kBatch; ++i) {
      const bool bright = batch.numbers[4][i] < 0.5f && batch.numbers[5][i] < 0.5f;
      const float dim = batch.numbers[6][i] * rare < 1 ? rare : 0;
      batch.scatter_return[i] = (bright ? 5 : dim) * inv_q[i];
    }
    VertexRecords records = batch.records();
    records.inv_q_scatter = inv_q.data();
    const auto recorder = learner.make_recorder();
    recorder->record(records);
    learner.merge(*recorder);
    field = learner.fit_field();
  }
  return field;
}

TEST(FieldLearner, SharesOfUniformNumbersAreWhatSuitsTheLight) {
  const Batch batch(1, 1);
  const auto brightest = [&](const Field& field) {
    return density(field, VertexDecision::scattering, batch, 0, {0.5f, 0.2f, 0.3f});
  };
  // f is 5, or 1 on average, 2 in all: the learned density is 2.5 where it is bright. If f has no noise, it is best.
  EXPECT_GT(brightest(*taught_by_its_own_draws(1)), 1 + 1.5f * 0.8f);
  // If the root mean square is 5 everywhere, uniform numbers are.
  EXPECT_LT(brightest(*taught_by_its_own_draws(25)), 1 + 1.5f * 0.4f);
}

TEST(FieldLearner, FewVerticesAreNotBelieved) {
  FieldLearner learner({}, 1);
  teach(learner, Batch(1, 2));
  const auto field = learner.fit_field();
  const Batch batch(1, 1);
  for (const float y : {0.1f, 0.4f, 0.9f})
    EXPECT_NEAR(density(*field, VertexDecision::scattering, batch, 0, {0.5f, y, y}), 1, 0.2);
}

TEST(FieldLearner, ValuesThatAreNotFiniteTeachNothing) {
  FieldLearner learner({}, 1);
  Batch batch(1, kBatch);
  std::fill(batch.scatter_return.begin(), batch.scatter_return.end(), std::nanf(""));
  std::fill(batch.light.begin(), batch.light.end(), INFINITY);
  teach(learner, batch);
  const auto field = learner.fit_field();
  for (const auto which : {VertexDecision::light_sampling, VertexDecision::scattering})
    EXPECT_FLOAT_EQ(density(*field, which, batch, 0, {0.1f, 0.2f, 0.3f}), 1);
}

TEST(FieldLearner, GoesOnFromAFieldAsIfItHadTaughtItself) {
  FieldSettings settings;
  settings.first_uniform_share = 0.1;
  const auto field = taught(settings, 100);
  const Batch batch(1, 200);
  const auto differ = [&](const Field& other) {
    double sum = 0;
    for (std::size_t i = 0; i < 200; ++i)
      for (const auto which : {VertexDecision::light_sampling, VertexDecision::scattering}) {
        const std::array<float, 3> y{0.5f, sample_float(i, 1), sample_float(i, 2)};
        const float q = density(*field, which, batch, i, y), p = density(other, which, batch, i, y);
        sum += std::fabs(p - q) / std::max(p, q) / 400;
      }
    return sum;
  };
  FieldLearner learner(settings, 1);
  learner.start_from(*field);
  // What few samples say is drawn to its surroundings a second time.
  EXPECT_LT(differ(*learner.fit_field()), 0.1);
  EXPECT_GT(differ(*taught(settings, 1)), 0.2);
  // Learning goes on: light from elsewhere now.
  for (std::uint64_t b = 0; b < 100; ++b) {
    Batch other(1000 + b, kBatch);
    for (std::size_t k = 0; k < kBatch; ++k) other.scatter_return[k] = other.numbers[4][k] > 0.5f ? 10.0f : 0.0f;
    teach(learner, other);
  }
  const auto changed = learner.fit_field();
  EXPECT_GT(density(*changed, VertexDecision::scattering, batch, 0, {0.5f, 0.9f, 0.5f}),
            2 * density(*changed, VertexDecision::scattering, batch, 0, {0.5f, 0.1f, 0.5f}));
}

TEST(FieldLearner, AFieldOfAnotherSceneIsAnError) {
  FieldLearner learner({}, 3);
  EXPECT_THROW(learner.start_from(*taught({}, 1)), ConfigError);
}

TEST(FieldLearner, NumberOfCellsIsBounded) {
  FieldSettings settings;
  settings.split_at = 10;
  settings.max_cells = 37;
  EXPECT_EQ(taught(settings, 8)->tree().cells(), 37u);
}

TEST(FieldLearner, VerticesInOnePlaceStayOneCell) {
  FieldSettings settings;
  settings.split_at = 10;
  FieldLearner learner(settings, 1);
  Batch batch(1, kBatch);
  for (auto& values : batch.floats) std::fill(values.begin(), values.end(), 0.25f);
  teach(learner, batch);
  EXPECT_EQ(learner.fit_field()->tree().cells(), 1u);
}

}  // namespace
}  // namespace warpath
