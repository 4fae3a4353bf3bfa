#include "tracer/frame.h"

#include <gtest/gtest.h>

#include "core/rng.h"

namespace warpath {
namespace {

Vec3 direction(std::uint64_t i) {
  const std::uint64_t key = sample_key(1, i);
  const float z = 1 - 2 * sample_float(key, 0), phi = 2 * kPi * sample_float(key, 1), r = std::sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

void expect_orthonormal(const Frame& f, float handedness) {
  for (const Vec3& v : {f.s, f.t, f.n}) EXPECT_NEAR(v.length(), 1, 2e-5f);
  EXPECT_NEAR(f.s.dot(f.t), 0, 2e-5f);
  EXPECT_NEAR(f.s.dot(f.n), 0, 2e-5f);
  EXPECT_NEAR(f.t.dot(f.n), 0, 2e-5f);
  EXPECT_NEAR(f.s.cross(f.t).dot(f.n), handedness, 4e-5f);
}

TEST(Frame, OfNormalIsOrthonormal) {
  for (int i = 0; i < 10'000; ++i) expect_orthonormal(frame_of_normal(direction(i)), 1);
  // Around the direction where it breaks, on both sides of the switch.
  const Vec3 pole(-0.36f, -0.48f, -0.8f);
  for (const float d : {0.0f, 1e-4f, 5e-3f, 9.9e-3f, 1.01e-2f, 0.02f})
    expect_orthonormal(frame_of_normal((pole + Vec3(d, -0.5f * d, 0.3f * d)).normalized()), 1);
}

TEST(Frame, OfNormalDoesNotTearFloorsAndWalls) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {1.0f, -1.0f}) {
      Vec3 n(0.0f);
      n[axis] = sign;
      const Frame reference = frame_of_normal(n);
      for (int i = 0; i < 100; ++i) {
        const Frame f = frame_of_normal((n + direction(i) * 1e-4f).normalized());
        EXPECT_LT((f.s - reference.s).length(), 1e-3f);
        EXPECT_LT((f.t - reference.t).length(), 1e-3f);
      }
    }
  }
}

TEST(Frame, OfTangentFollowsIt) {
  for (int i = 0; i < 1000; ++i) {
    const Vec3 n = direction(2 * i), tangent = direction(2 * i + 1) * 3.0f;
    const bool left = i % 2 == 1;
    const Frame f = frame_of_tangent(n, tangent, left);
    expect_orthonormal(f, left ? -1.0f : 1.0f);
    EXPECT_GE(f.s.dot(tangent), 0);
    EXPECT_NEAR(f.t.dot(tangent), 0, 1e-3f);
  }
}

TEST(Frame, OfTangentNeedsNoTangent) {
  const Vec3 n = Vec3(0.2f, 0.9f, -0.3f).normalized();
  expect_orthonormal(frame_of_tangent(n, Vec3(0.0f), false), 1);
  expect_orthonormal(frame_of_tangent(n, n * 7.0f, false), 1);
}

TEST(Frame, LocalAndWorldAreInverse) {
  for (int i = 0; i < 1000; ++i) {
    const Frame f = frame_of_normal(direction(i));
    const Vec3 v = direction(i + 5000);
    EXPECT_LT((f.to_world(f.to_local(v)) - v).length(), 1e-4f);
  }
}

}  // namespace
}  // namespace warpath
