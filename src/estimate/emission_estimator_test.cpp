#include "estimate/emission_estimator.h"

#include <gtest/gtest.h>

#include <cmath>

#include "estimate/film_positions.h"
#include "tracer/test_scene.h"

namespace warpath {
namespace {

using testing::SceneBuilder;

constexpr float kRadiance = 3;
constexpr std::uint64_t kPixels = 64 * 64;

/// A square light in the middle of the film, before nothing.
Tracer square_light(float half_size, bool hide = false) {
  SceneBuilder b;
  b.light(testing::make_rectangle(testing::facing({0, 0, 0}, {0, 0, 1}, half_size)), Color(kRadiance));
  b.scene.film.filter = {ReconstructionFilter::Type::box, 0.5f};
  b.scene.integrator.hide_emitters = hide;
  return Tracer(std::move(b.scene));
}

/// Every camera ray sees it.
Tracer sky() {
  SceneBuilder b;
  b.emitter(ConstantEmitter{Color(2.0f)});
  return Tracer(std::move(b.scene));
}

bool never() { return false; }

TEST(EmissionEstimator, ShowsALightWhereItIs) {
  const float half_size = 0.5f;
  const Tracer tracer = square_light(half_size);
  EmissionEstimator emission(tracer, tiled_pixels(64, 64), 1);
  ASSERT_TRUE(emission.sees_any());
  emission.add_pass(4, never);
  const ImageEstimate image = emission.develop();
  // In pixels from the middle of the film, from a distance of 5 with a field of view of 40 degrees.
  const double edge = 32 * half_size / (5 * std::tan(20 * kPi / 180));
  double sum = 0, variance = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const auto pixel = static_cast<std::size_t>(y * 64 + x);
      const double nearest = std::max(std::fabs(x - 31.5), std::fabs(y - 31.5));
      sum += image.mean[pixel].y;
      variance += image.variance[pixel].y;
      if (std::fabs(nearest - edge) <= 0.51) continue;
      EXPECT_FLOAT_EQ(image.mean[pixel].y, nearest < edge ? kRadiance : 0) << x << ", " << y;
      EXPECT_EQ(image.variance[pixel].y, 0) << x << ", " << y;
    }
  // 5 standard errors, as the film tells them: a false alarm in 1.7 million seeds if noise were normal.
  ASSERT_GT(variance, 0) << "edges cross pixels";
  EXPECT_NEAR(sum / kRadiance, 4 * edge * edge, 5 * std::sqrt(variance) / kRadiance);
}

TEST(EmissionEstimator, GivesAQuarterOfThePathsToFewPixels) {
  const Tracer tracer = square_light(0.1f);
  EmissionEstimator emission(tracer, tiled_pixels(64, 64), 1);
  const std::uint64_t rays = emission.add_pass(100, never);
  EXPECT_GT(rays, 100 * kPixels / 8);
  EXPECT_LT(rays, 100 * kPixels * 11 / 40) << "whole rows of grids bring a little more";
}

TEST(EmissionEstimator, GivesFourRaysToAPathWhereAllSeeIt) {
  const Tracer tracer = sky();
  EmissionEstimator emission(tracer, tiled_pixels(64, 64), 1);
  EXPECT_EQ(emission.add_pass(4, never), 4 * 4 * kPixels);
  const ImageEstimate image = emission.develop();
  for (const Color& mean : image.mean) EXPECT_FLOAT_EQ(mean.y, 2);
  for (const Color& variance : image.variance) EXPECT_EQ(variance.y, 0);
}

TEST(EmissionEstimator, IsBlackWhereEmittersAreHidden) {
  const Tracer tracer = square_light(0.5f, true);
  EmissionEstimator emission(tracer, tiled_pixels(64, 64), 1);
  EXPECT_FALSE(emission.sees_any());
  EXPECT_EQ(emission.add_pass(4, never), 0u);
  const ImageEstimate image = emission.develop();
  ASSERT_EQ(image.mean.size(), kPixels);
  for (const Color& mean : image.mean) EXPECT_EQ(mean, Color(0.0f));
}

TEST(EmissionEstimator, StopsBetweenBatches) {
  const Tracer tracer = sky();
  EmissionEstimator emission(tracer, tiled_pixels(64, 64), 1);
  int asked = 0;
  const std::uint64_t some = emission.add_pass(4, [&] { return ++asked > 2; });
  EXPECT_GT(some, 0u);
  EXPECT_LT(some, 4 * 4 * kPixels);
  EXPECT_EQ(emission.add_pass(4, [] { return true; }), 0u);
}

}  // namespace
}  // namespace warpath
