#include "tracer/tracer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tracer/sampling.h"
#include "tracer/test_scene.h"

namespace warpath {
namespace {

using testing::Estimate;
using testing::estimate;
using testing::facing;
using testing::make_ids;
using testing::make_rectangle;
using testing::make_sphere;
using testing::scale;
using testing::SceneBuilder;
using testing::translate;

constexpr float kNarrow = 0.01f;  // degrees: all rays see the same point
// Every z-test below fails by chance once in 150,000 runs.
constexpr double kZ = 4.5;

void expect_mean(const Estimate& e, double expected, double tolerance = 1e-4) {
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(e.mean[c], expected, kZ * e.error[c] + tolerance * std::fabs(expected))
        << "standard error " << e.error[c];
}

// Looks at the origin of a diffuse floor of reflectance 1/2, from one side, as if through a straw.
SceneBuilder floor_seen_through_a_straw() {
  SceneBuilder b;
  b.look({6, 1, 1}, {0, 0, 0}, {0, 0, 1}, kNarrow);
  // Off the floor's diagonal: rays that run exactly along the edge of two triangles may slip through.
  b.shape(make_rectangle(scale(Vec3(100)) * translate({7, 3, 0})), b.diffuse(Color(0.5f)));
  return b;
}
// Radiance of that floor under an irradiance.
double floor_radiance(double irradiance) { return 0.5 / kPi * irradiance; }

TEST(Furnace, DiffuseSphereUnderAConstantSkyLosesNothing) {
  for (const float albedo : {0.2f, 1.0f}) {
    SceneBuilder b;
    b.shape(make_sphere({0, 0, 0}, 1), b.diffuse(Color(albedo)));
    b.emitter(ConstantEmitter{Color(2.0f)});
    b.look({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 15);  // the sphere fills the film
    expect_mean(estimate(Tracer(std::move(b.scene)), 1, 100000), 2 * albedo);
  }
}

TEST(Furnace, ClosedBoxThatGlows) {
  SceneBuilder b;
  const float albedo = 0.6f, emitted = 0.5f;
  b.box(b.diffuse(Color(albedo)), b.constant(Color(emitted)));
  b.look({0.1f, 0.2f, 0.3f}, {0.7f, 0.9f, -1}, {0, 1, 0}, 60);
  const Tracer tracer(std::move(b.scene));
  expect_mean(estimate(tracer, 2, 200000), emitted * albedo / (1 - albedo));
  expect_mean(estimate(tracer, 2, 1000, true), emitted);
}

TEST(Furnace, SphereOfSpheresFromWithin) {
  SceneBuilder b;
  const float albedo = 0.8f;
  b.light(make_sphere({0, 0, 0}, 3, true), b.diffuse(Color(albedo)), b.constant(Color(1.0f)));
  b.look({0.5f, 0, 0}, {1, 2, 1}, {0, 1, 0}, 50);
  expect_mean(estimate(Tracer(std::move(b.scene)), 3, 200000), albedo / (1 - albedo));
}

// After k bounces of the glowing box the series is cut off: sum of albedo^i for i = 1 .. max_depth - 1.
TEST(Depth, MaxDepthCutsTheSeriesAsMitsubaCountsIt) {
  for (const int depth : {0, 1, 2, 3, 5}) {
    SceneBuilder b;
    const float albedo = 0.6f;
    b.box(b.diffuse(Color(albedo)), b.constant(Color(1.0f)));
    b.look({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 60);
    b.scene.integrator.max_depth = depth;
    const Tracer tracer(std::move(b.scene));
    double expected = 0;
    for (int i = 1; i < depth; ++i) expected += std::pow(albedo, i);
    expect_mean(estimate(tracer, 4, 50000), expected);
    expect_mean(estimate(tracer, 4, 100, true), depth >= 1 ? 1 : 0);
  }
}

TEST(Roulette, DoesNotChangeTheMean) {
  Estimate results[2];
  for (const int k : {0, 1}) {
    SceneBuilder b;
    b.box(b.diffuse(Color(0.7f, 0.5f, 0.2f)));
    b.light(make_rectangle(facing({0, 0.99f, 0}, {0, -1, 0}, 0.3f)), Color(5.0f));
    b.look({0, 0, 0.9f}, {0, 0, -1}, {0, 1, 0}, 70);
    b.scene.integrator.max_depth = 10;
    b.scene.integrator.rr_depth = k == 0 ? 1 : 100;
    results[k] = estimate(Tracer(std::move(b.scene)), 5 + static_cast<std::uint64_t>(k), 300000);
  }
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(results[0].mean[c], results[1].mean[c], kZ * std::hypot(results[0].error[c], results[1].error[c]));
}

TEST(ClosedForm, PointLightOverAFloor) {
  SceneBuilder b = floor_seen_through_a_straw();
  b.emitter(PointEmitter{{3, 0, 4}, Color(10.0f)});
  expect_mean(estimate(Tracer(std::move(b.scene)), 1, 1000), floor_radiance(10.0 / 25 * 4 / 5), 1e-3);
}

TEST(ClosedForm, SunOverAFloor) {
  SceneBuilder b = floor_seen_through_a_straw();
  b.emitter(DirectionalEmitter{Vec3(0, -3, -4) / 5, Color(10.0f)});
  expect_mean(estimate(Tracer(std::move(b.scene)), 1, 1000), floor_radiance(10 * 0.8), 1e-3);
}

TEST(ClosedForm, RectangleLightOverAFloor) {
  for (const bool as_mesh : {false, true}) {
    SceneBuilder b = floor_seen_through_a_straw();
    const Matrix4 m = scale({1.5f, 0.5f, 1}) * facing({0, 0, 2}, {0, 0, -1}, 1);
    as_mesh ? b.light(SceneBuilder::grid(3, m), Color(3.0f)) : b.light(make_rectangle(m), Color(3.0f));
    // Four times the form factor of a parallel rectangle with a corner above the point.
    const double x = 1.5 / 2, y = 0.5 / 2;
    const double a = std::sqrt(1 + x * x), c = std::sqrt(1 + y * y);
    const double factor = 4 * (x / a * std::atan(y / a) + y / c * std::atan(x / c)) / (2 * kPi);
    expect_mean(estimate(Tracer(std::move(b.scene)), 7, 100000), floor_radiance(3 * kPi * factor), 1e-3);
  }
}

TEST(ClosedForm, SphereAndDiskLightsOverAFloor) {
  for (const bool as_disk : {false, true}) {
    SceneBuilder b = floor_seen_through_a_straw();
    const float radius = 0.8f, height = 2;
    const Matrix4 m = facing({0, 0, height}, {0, 0, -1}, radius);
    as_disk ? b.light(Disk{{m, m}, false}, Color(3.0f)) : b.light(make_sphere({0, 0, height}, radius), Color(3.0f));
    const double sine2 = as_disk ? sqr(radius) / (sqr(radius) + sqr(height)) : sqr(radius) / sqr(height);
    expect_mean(estimate(Tracer(std::move(b.scene)), 8, 100000), floor_radiance(3 * kPi * sine2), 1e-3);
  }
}

TEST(ClosedForm, CylinderLightOverAFloor) {
  SceneBuilder b = floor_seen_through_a_straw();
  const float radius = 0.4f, length = 3, height = 1.5f;
  Matrix4 m;  // the axis along x
  m.setAxisAngle(Vec3(0, 1, 0), kPi / 2);
  m = scale({radius, radius, length}) * m * translate({-1, 0, height});
  b.light(Cylinder{{m, m}, false}, Color(2.0f));
  double irradiance = 0;
  const int n = 2000;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n / 4; ++j) {
      const double x = -1 + length * (i + 0.5) / n, phi = 2 * kPi * (j + 0.5) / (n / 4);
      const double ny = std::cos(phi), nz = std::sin(phi), y = radius * ny, z = height + radius * nz;
      const double d2 = x * x + y * y + z * z, facing_us = -(y * ny + z * nz);
      if (facing_us > 0) irradiance += z * facing_us / (d2 * d2);
    }
  irradiance *= 2.0 * 2 * kPi * radius * length / (n * (n / 4.0));
  expect_mean(estimate(Tracer(std::move(b.scene)), 9, 100000), floor_radiance(irradiance), 1e-3);
}

TEST(ClosedForm, GradientSkyOverAFloor) {
  SceneBuilder b = floor_seen_through_a_straw();
  auto image = std::make_shared<Image>();
  image->width = 64, image->height = 65, image->channels = 3;
  std::vector<float> pixels;
  for (int y = 0; y < 65; ++y)
    for (int i = 0; i < 64 * 3; ++i) pixels.push_back(sqr(1 - y / 64.0f));
  image->pixels = pixels;
  Matrix4 up;  // local +y to world +z
  up.setAxisAngle(Vec3(1, 0, 0), kPi / 2);
  b.emitter(EnvmapEmitter{image, 3, up});
  double irradiance = 0;
  const int n = 64 * 100;
  for (int i = 0; i < n / 2; ++i) {
    const double v = (i + 0.5) / n, theta = v * kPi, row = v * 64, t = row - std::floor(row);
    const double below = 1 - std::floor(row) / 64, above = 1 - (std::floor(row) + 1) / 64;
    const double radiance = 3 * ((1 - t) * below * below + t * above * above);
    irradiance += radiance * std::cos(theta) * std::sin(theta) * 2 * kPi * kPi / n;
  }
  expect_mean(estimate(Tracer(std::move(b.scene)), 10, 100000), floor_radiance(irradiance), 1e-3);
}

TEST(ClosedForm, BsdfAndLightSamplingAgreeBetweenManyLights) {
  SceneBuilder b = floor_seen_through_a_straw();
  b.light(make_rectangle(facing({0, 0, 1}, {0, 0, -1}, 0.5f)), Color(1.0f));
  b.emitter(PointEmitter{{3, 0, 4}, Color(10.0f)});
  b.light(make_sphere({0, 3, 0.5f}, 0.1f), Color(0.0f));
  b.scene.emitters[1].sampling_weight = 0.3f;
  const double a = std::sqrt(1.25), factor = 4 * 2 * (0.5 / a * std::atan(0.5 / a)) / (2 * kPi);
  expect_mean(estimate(Tracer(std::move(b.scene)), 11, 200000),
              floor_radiance(kPi * factor) + floor_radiance(10.0 / 25 * 4 / 5), 1e-3);
}

TEST(Motion, ShapesAreSeenForTheShareOfTimeThatTheyPassBy) {
  const auto seen = [](auto geometry) {
    SceneBuilder b;
    b.look({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, kNarrow);
    b.light(geometry, Color(1.0f));
    return estimate(Tracer(std::move(b.scene)), 12, 50000, true);
  };
  expect_mean(seen(Rectangle{{translate({-2, 0, 0}), translate({2, 0, 0})}, false}), 0.5, 1e-3);
  Sphere sphere = make_sphere({-2, 0.5f, 0}, 1);
  sphere.center[1] = {2, 0.5f, 0};
  expect_mean(seen(sphere), 2 * std::sqrt(0.75) / 4, 1e-3);
}

TEST(Motion, LightOfAMovingLampIsItsMeanOverTime) {
  SceneBuilder b = floor_seen_through_a_straw();
  const float radius = 0.5f;
  Sphere sphere = make_sphere({0, 0, 1}, radius);
  sphere.center[1] = {0, 0, 3};
  b.light(sphere, Color(1.0f));
  // Mean of pi (r / h)^2 over h from 1 to 3.
  expect_mean(estimate(Tracer(std::move(b.scene)), 13, 200000), floor_radiance(kPi * sqr(radius) * (1 - 1.0 / 3) / 2),
              1e-3);
}

TEST(Motion, MovingCameraSeesWithItsTime) {
  SceneBuilder b;
  b.light(make_rectangle(translate({0, 0, 0})), Color(1.0f));
  b.look({-2, 0, 5}, {-2, 0, 0}, {0, 1, 0}, kNarrow);
  b.scene.sensor.to_world[1] = testing::look_at({2, 0, 5}, {2, 0, 0}, {0, 1, 0});
  expect_mean(estimate(Tracer(std::move(b.scene)), 14, 50000, true), 0.5, 1e-3);
}

TEST(Lens, EdgeIsSharpInFocusAndBlursBeyond) {
  // The film's middle looks 0.05 beside the edge of a half-plane; radius of the blur there is aperture |z - f| / f.
  const auto seen = [](float depth) {
    SceneBuilder b;
    b.look({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, kNarrow);
    b.scene.sensor.aperture_radius = 0.1f;
    b.scene.sensor.focus_distance = 5;
    b.light(make_rectangle(scale({1000, 1000, 1}) * translate({1000.05f, 0, -depth})), Color(1.0f));
    return estimate(Tracer(std::move(b.scene)), 15, 100000, true);
  };
  expect_mean(seen(5), 0);
  // At depth 10 the disk has radius 0.1; the half-plane covers the segment beyond half of it.
  const double segment = (std::acos(0.5) - 0.5 * std::sqrt(0.75)) / kPi;
  expect_mean(seen(10), segment, 5e-3);
}

TEST(HideEmitters, CameraSeesThroughThemAndTheyStillLight) {
  SceneBuilder b = floor_seen_through_a_straw();
  b.emitter(ConstantEmitter{Color(0.5f)});
  b.light(make_sphere({0.4f, 0.1f, 0.6f}, 0.1f), Color(0.0f));  // in the way
  b.scene.integrator.hide_emitters = true;
  b.scene.integrator.max_depth = 2;
  Tracer tracer(std::move(b.scene));
  const Estimate e = estimate(tracer, 16, 100000), direct = estimate(tracer, 16, 100, true);
  EXPECT_EQ(direct.mean[0], 0);
  EXPECT_GT(e.mean[0], 0.9 * 0.25) << "the lamp only shades a little";
  EXPECT_LT(e.mean[0], 0.25);
  for (const auto pixel : tracer.may_see_emission()) EXPECT_EQ(pixel, 0);
}

TEST(FirstHits, AlbedoNormalAndDistance) {
  SceneBuilder b;
  b.shape(make_rectangle(translate({0, 0, -1})), b.diffuse(Color(0.2f, 0.4f, 0.8f)));
  b.look({0, 0, 1}, {0, 0, -1}, {0, 1, 0}, 90);
  const Tracer tracer(std::move(b.scene));
  const std::size_t n = 4000;
  const auto ids = make_ids(0, n);
  UniformSource source(1, ids);
  FirstHits hits;
  tracer.trace_first_hits(source, n, hits);
  for (std::size_t i = 0; i < n; ++i) {
    const float x = hits.film_x[i] / 32 - 1, y = 1 - hits.film_y[i] / 32;  // at distance 1; the square is at 2
    const bool inside = std::fabs(x) < 0.4999f && std::fabs(y) < 0.4999f;
    if (!inside && std::fabs(x) < 0.5001f && std::fabs(y) < 0.5001f) continue;
    EXPECT_EQ(hits.distance[i] > 0, inside);
    EXPECT_NEAR(hits.normal[i].z, inside ? 1 : 0, 1e-6f);
    EXPECT_NEAR(hits.albedo[i].z, inside ? 0.8f : 0, 1e-6f);
    if (inside) {
      EXPECT_NEAR(hits.distance[i], (2 - 1e-3f) * std::sqrt(1 + x * x + y * y), 1e-4f);
    }
  }
}

}  // namespace
}  // namespace warpath
