#include "tracer/light_samples.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tracer/compiled_scene.h"
#include "tracer/simd_targets.h"
#include "tracer/test_scene.h"
#include "tracer/workspace.h"

namespace warpath {
namespace {

using testing::SceneBuilder;

constexpr std::size_t kCount = 1003;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A room lit by `count` rectangles, of different sizes, weights and directions.
SceneBuilder rectangles(int count) {
  SceneBuilder b;
  for (int i = 0; i < count; ++i) {
    const auto f = static_cast<float>(i);
    const Vec3 normal = Vec3(std::sin(f), std::cos(3 * f), 0.3f).normalized();
    const Matrix4 m = testing::scale({1 + 0.2f * f, 0.5f, 1}) * testing::facing(normal * -3, normal, 0.4f);
    b.light(testing::make_rectangle(m, i % 3 == 1), Color(1, 2 + f, 3));
    b.scene.emitters.back().sampling_weight = 1 + f;
  }
  return b;
}

struct Arrays {
  Arrays() {
    memory.reserve(64);
    const auto floats = [&] { return memory.emplace_back(kCount + Arena::kPad).data(); };
    const auto vectors = [&] { return Vec3Array{floats(), floats(), floats()}; };
    from = vectors(), ng = vectors(), value = vectors(), light = vectors();
    choice = floats(), u = floats(), v = floats(), time = floats(), pdf = floats(), inv_q = floats();
    samples = {vectors(), floats(), floats(), vectors()};
    rays = {floats(), floats(), floats(), floats(), floats(), floats(), floats(), floats()};
    vertex.resize(kCount + Arena::kPad);
    for (std::size_t k = 0; k < kCount; ++k) {
      const std::uint64_t key = sample_key(5, k);
      std::uint32_t d = 0;
      const auto number = [&] { return sample_float(key, d++); };
      from.set(k, {number() - 0.5f, number() - 0.5f, number() - 0.5f});
      ng.set(k, Vec3(number() - 0.5f, number() - 0.5f, number() - 0.5f).normalized());
      value.set(k, k % 7 == 2 ? Vec3(0) : Vec3(number(), 0.0f, number()));
      choice[k] = number(), u[k] = number(), v[k] = number(), time[k] = number();
      pdf[k] = number(), inv_q[k] = 2 * number();
    }
  }
  std::vector<std::vector<float>> memory;
  Vec3Array from, ng, value, light;
  float *choice, *u, *v, *time, *pdf, *inv_q;
  LightSamples samples;
  RayStream rays;
  std::vector<std::uint32_t> vertex;
};

void expect_near(float a, float b) { EXPECT_NEAR(a, b, 1e-5f * std::max(std::abs(a), std::abs(b)) + 1e-6f); }

TEST(RectangleLights, SampleAsEmittersDoOneByOne) {
  for (const int count : {1, 3, 8, 9, 16, 17}) {  // in a register of either width, gathered, and too many
    SCOPED_TRACE(count);
    SceneBuilder builder = rectangles(count);
    const CompiledScene scene(std::move(builder.scene));
    testing::on_every_simd_target([&] {
      const Arrays a;
      scene.emitters.sample(kCount, a.from, count > 1 ? a.choice : nullptr, a.u, a.v, a.time, a.samples);
      int lit = 0;
      for (std::size_t k = 0; k < kCount && !HasFailure(); ++k) {
        EmitterSample s;
        if (!scene.emitters.sample(a.from[k], a.choice[k], {a.u[k], a.v[k]}, 0, s)) {
          EXPECT_EQ(a.samples.weight[k], Vec3(0));
          continue;
        }
        ++lit;
        for (int c = 0; c < 3; ++c) {
          expect_near(a.samples.wo[k][c], s.wo[c]);
          expect_near(a.samples.weight[k][c], s.weight[c]);
        }
        expect_near(a.samples.distance[k], s.distance);
        expect_near(a.samples.pdf[k], s.pdf);
      }
      EXPECT_GT(lit, 300);
    });
  }
}

TEST(LightSamples, OfAllEmittersTogetherAreThoseOneByOne) {
  SceneBuilder b;
  b.emitter(PointEmitter{Vec3(1, 2, 3), Color(4.0f)});
  b.light(testing::make_sphere({0, 3, 0}, 0.5f), Color(1, 2, 3));
  b.emitter(ConstantEmitter{Color(0.5f)});
  const CompiledScene scene(std::move(b.scene));
  const Arrays a;
  scene.emitters.sample(kCount, a.from, a.choice, a.u, a.v, a.time, a.samples);
  for (std::size_t k = 0; k < kCount; ++k) {
    EmitterSample s;
    if (!scene.emitters.sample(a.from[k], a.choice[k], {a.u[k], a.v[k]}, a.time[k], s)) {
      EXPECT_EQ(a.samples.weight[k], Vec3(0));
      continue;
    }
    EXPECT_EQ(a.samples.wo[k], s.wo);
    EXPECT_EQ(a.samples.distance[k], s.distance);
    EXPECT_EQ(a.samples.pdf[k], s.delta ? kInfinity : s.pdf);
    EXPECT_EQ(a.samples.weight.color(k), s.weight);
  }
}

TEST(ShadowRays, LeaveWhereLightWouldArriveAndEndBeforeTheEmitter) {
  testing::on_every_simd_target([&] {
    for (const bool weighted : {false, true}) {
      Arrays a;
      const LightSamples& s = a.samples;
      for (std::size_t k = 0; k < kCount; ++k) {
        s.wo.set(k, Vec3(a.u[k] - 0.5f, a.v[k] - 0.5f, 0.3f).normalized());
        s.distance[k] = k % 4 == 0 ? kInfinity : 1 + a.choice[k];
        s.pdf[k] = k % 3 == 0 ? kInfinity : a.choice[k];
        s.weight.set(k, k % 5 == 1 ? Vec3(0) : Vec3(2.0f));
      }
      const std::size_t count = make_shadow_rays(kCount, a.from, a.ng, a.time, s, a.value, a.pdf,
                                                 weighted ? a.inv_q : nullptr, a.rays, a.light, a.vertex.data());
      std::size_t i = 0;
      for (std::uint32_t k = 0; k < kCount && !HasFailure(); ++k) {
        if (k % 7 == 2 || k % 5 == 1) continue;
        ASSERT_LT(i, count);
        ASSERT_EQ(a.vertex[i], k);
        const float p = s.pdf[k], mis = std::isinf(p) ? 1 : p * p / (p * p + a.pdf[k] * a.pdf[k]);
        for (int c = 0; c < 3; ++c)
          expect_near(a.light[i][c], 2 * a.value[k][c] * mis * (weighted ? a.inv_q[k] : 1.0f));
        const Vec3 origin = offset_point(a.from[k], a.ng[k], s.wo[k]);
        EXPECT_LT((a.rays.origin(i) - origin).length(), 1e-6f);
        EXPECT_EQ(a.rays.time[i], a.time[k]);
        if (std::isinf(s.distance[k])) {
          EXPECT_EQ(a.rays.direction(i), s.wo[k]);
          EXPECT_EQ(a.rays.t_max[i], std::numeric_limits<float>::max());
        } else {
          const Vec3 end = a.rays.origin(i) + a.rays.direction(i) * (a.rays.t_max[i] / (1 - kShadowEpsilon));
          EXPECT_LT((end - (a.from[k] + s.wo[k] * s.distance[k])).length(), 1e-5f);
        }
        ++i;
      }
      EXPECT_EQ(i, count);
    }
  });
}

// What was not sampled has weight 0 and a direction that nobody set: whatever memory held.
TEST(ShadowRays, NoneWhereThereIsNoSampleWhateverItsDirection) {
  testing::on_every_simd_target([&] {
    Arrays a;
    const float nan = std::nanf(""), most = std::numeric_limits<float>::max();
    for (std::size_t k = 0; k < kCount; ++k) {
      a.samples.weight.set(k, Vec3(0));
      a.samples.wo.set(k, k % 2 ? Vec3(0.6f, most, most) : Vec3(nan));
      a.samples.distance[k] = a.samples.pdf[k] = k % 3 ? nan : kInfinity;
      a.value.set(k, k % 2 ? Vec3(nan) : Vec3(kInfinity));
      a.pdf[k] = k % 5 ? nan : most;
    }
    EXPECT_EQ(make_shadow_rays(kCount, a.from, a.ng, a.time, a.samples, a.value, a.pdf, nullptr, a.rays, a.light,
                               a.vertex.data()),
              0u);
  });
}

}  // namespace
}  // namespace warpath
