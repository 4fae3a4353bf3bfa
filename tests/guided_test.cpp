// Passes that learn from those before them, by a field at every vertex and by counts of samples per pixel, give the
// image of plain path tracing, and the same bits for any number of threads.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <map>
#include <memory>

#include "estimate/image_estimator.h"
#include "scene/scene.h"
#include "train/field_trainer.h"

namespace warpath {
namespace {

const Tracer& box_tracer(int width, int height) {
  static std::map<std::pair<int, int>, std::unique_ptr<const Tracer>> tracers;
  auto& tracer = tracers[{width, height}];
  if (!tracer) {
    SceneOptions options;
    options.width = width;
    options.height = height;
    Scene scene = load_scene(std::string(WARPATH_SOURCE_DIR) + "/scenes/box/scene.xml", options);
    // Under a box every pixel's divisor is known beforehand, so that its estimate is unbiased for any number of
    // samples.
    scene.film.filter = {ReconstructionFilter::Type::box, 0.5f};
    tracer = std::make_unique<const Tracer>(std::move(scene));
  }
  return *tracer;
}

/// Passes of `spp` samples per pixel, each guided by those before it.
ImageEstimate guided(const Tracer& tracer, const std::vector<int>& spp, std::optional<Objective> objective,
                     bool with_field, std::uint64_t seed) {
  ImageEstimator estimator(tracer, {}, nullptr, seed);
  FieldSettings settings;
  settings.split_at = 200;
  FieldTrainer trainer(settings, tracer.emitters());
  std::shared_ptr<const Field> field;
  for (const int n : spp) {
    estimator.add_guided_pass(n, {field.get(), with_field ? &trainer : nullptr, objective});
    if (with_field) field = trainer.fit();
  }
  return estimator.develop_rest();
}

/// Mean and variance of the mean over independent images, per pixel.
struct Spread {
  std::vector<double> sum, square;
  int runs = 0;
  void add(const ImageEstimate& image) {
    sum.resize(image.mean.size());
    square.resize(image.mean.size());
    for (std::size_t p = 0; p < sum.size(); ++p) {
      const double value = luminance(image.mean[p]);
      sum[p] += value;
      square[p] += value * value;
    }
    ++runs;
  }
  double mean(std::size_t p) const { return sum[p] / runs; }
  double variance(std::size_t p) const { return (square[p] / runs - mean(p) * mean(p)) / (runs - 1); }
};

/// Compares every pixel, and the whole image, whose noise is smaller. 4.5 standard errors for each: a false alarm in
/// 147,000 / (pixels + 1) choices of seeds. largest_error: relative standard error of the whole image, so small that a
/// wrong density would show.
void expect_same_means(const Spread& a, const Spread& b, double largest_error) {
  double difference = 0, variance = 0, mean = 0;
  for (std::size_t p = 0; p < a.sum.size(); ++p) {
    const double v = a.variance(p) + b.variance(p);
    EXPECT_NEAR(a.mean(p), b.mean(p), 4.5 * std::sqrt(v)) << "pixel " << p;
    difference += a.mean(p) - b.mean(p);
    variance += v;
    mean += b.mean(p);
  }
  EXPECT_LT(std::fabs(difference), 4.5 * std::sqrt(variance));
  EXPECT_LT(std::sqrt(variance), largest_error * mean);
}

Spread plain(const Tracer& tracer, int runs, int spp) {
  Spread spread;
  for (int run = 0; run < runs; ++run) {
    ImageEstimator estimator(tracer, {}, nullptr, 90000 + static_cast<std::uint64_t>(run));
    estimator.add_pass(spp);
    spread.add(estimator.develop_rest());
  }
  return spread;
}

TEST(Guided, FieldsAndAllocationLeaveEveryPixelsMeanAsItIs) {
  const Tracer& tracer = box_tracer(12, 8);
  const Spread reference = plain(tracer, 64, 512);
  for (const auto objective :
       {std::optional<Objective>{}, std::optional(Objective::mse), std::optional(Objective::relmse)}) {
    Spread spread;
    for (std::uint64_t seed = 0; seed < 200; ++seed)
      spread.add(guided(tracer, {16, 16, 32, 64}, objective, true, seed));
    expect_same_means(spread, reference, 0.01);
  }
}

// What a pixel's own fireflies could do to it: with 4 samples a pixel that saw one gets more samples in the pass after,
// and would come out wrong if those weighed more, too (Kirk and Arvo 1991).
TEST(Guided, CountsThatFollowFirefliesDoNotBiasThem) {
  const Tracer& tracer = box_tracer(4, 3);
  const Spread reference = plain(tracer, 64, 16384);
  Spread spread;
  for (std::uint64_t seed = 0; seed < 20000; ++seed) spread.add(guided(tracer, {4, 4}, Objective::mse, false, seed));
  expect_same_means(spread, reference, 0.005);
}

TEST(Guided, SameSeedSameBitsForAnyNumberOfThreads) {
  const auto bits = [](int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    return guided(box_tracer(48, 32), {2, 2, 4, 8}, Objective::relmse, true, 7).mean;
  };
  const auto one = bits(1), two = bits(2), again = bits(2);
  ASSERT_EQ(one.size(), two.size());
  EXPECT_EQ(std::memcmp(one.data(), two.data(), one.size() * sizeof(Color)), 0);
  EXPECT_EQ(std::memcmp(two.data(), again.data(), one.size() * sizeof(Color)), 0);
}

// A field that helps nothing would pass all else.
TEST(Guided, FieldLessensTheVariance) {
  const Tracer& tracer = box_tracer(48, 32);
  double guided_variance = 0, plain_variance = 0;
  ImageEstimator estimator(tracer, {}, nullptr, 5);
  FieldTrainer trainer({}, tracer.emitters());
  for (int pass = 0; pass < 8; ++pass) estimator.add_guided_pass(64, {nullptr, &trainer, std::nullopt});
  const auto field = trainer.fit();
  ImageEstimator with(tracer, {}, nullptr, 6), without(tracer, {}, nullptr, 6);
  with.add_guided_pass(64, {field.get(), nullptr, std::nullopt});
  without.add_pass(64);
  for (const Color& v : with.develop_rest().variance) guided_variance += luminance(v);
  for (const Color& v : without.develop_rest().variance) plain_variance += luminance(v);
  EXPECT_LT(guided_variance, 0.9 * plain_variance);
}

}  // namespace
}  // namespace warpath
