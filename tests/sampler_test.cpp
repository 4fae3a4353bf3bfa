// Samplers change how fast an image converges and nothing else: every pixel's mean is that of independent samples,
// bits do not depend on threads, and the variance that an image tells of itself is the one that repetitions show.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <memory>

#include "estimate/image_estimator.h"
#include "family/fit.h"
#include "integrand/path_integrand.h"
#include "scene/scene.h"
#include "train/candidates.h"
#include "train/field_learner.h"

namespace warpath {
namespace {

const std::shared_ptr<const Tracer>& box_tracer() {
  static const auto tracer = [] {
    SceneOptions options;
    options.width = 12;
    options.height = 8;
    return std::make_shared<const Tracer>(
        load_scene(std::string(WARPATH_SOURCE_DIR) + "/scenes/box/scene.xml", options));
  }();
  return tracer;
}

/// Mean, variance of one image and mean of predicted variances over independent images, per pixel.
struct Spread {
  std::vector<double> sum, square, predicted;
  int runs = 0;
  double mean(std::size_t p) const { return sum[p] / runs; }
  double variance(std::size_t p) const { return (square[p] / runs - mean(p) * mean(p)) * runs / (runs - 1); }
};
Spread repeat(int runs, std::uint64_t seed, const std::function<ImageEstimate(std::uint64_t)>& image) {
  Spread spread;
  for (; spread.runs < runs; ++spread.runs) {
    const ImageEstimate estimate = image(seed + static_cast<std::uint64_t>(spread.runs));
    for (auto* values : {&spread.sum, &spread.square, &spread.predicted}) values->resize(estimate.mean.size());
    for (std::size_t p = 0; p < estimate.mean.size(); ++p) {
      const double value = estimate.mean[p].y;
      spread.sum[p] += value;
      spread.square[p] += value * value;
      spread.predicted[p] += estimate.variance[p].y;
    }
  }
  return spread;
}

ImageEstimate render(Sampler sampler, const Layout& layout, const std::shared_ptr<const Proposal>& proposal, int spp,
                     std::uint64_t seed) {
  ImageEstimator estimator(*box_tracer(), layout, proposal, seed, sampler);
  estimator.add_pass(spp / 2);
  estimator.add_pass(spp - spp / 2);
  return estimator.develop_rest();
}
ImageEstimate render_field(Sampler sampler, const std::vector<int>& passes, std::uint64_t seed) {
  ImageEstimator estimator(*box_tracer(), {}, nullptr, seed, sampler);
  FieldSettings settings;
  settings.split_at = 200;
  FieldLearner learner(settings, box_tracer()->emitters());
  std::shared_ptr<const Field> field;
  for (const int spp : passes) {
    estimator.add_guided_pass(spp, {field.get(), &learner, Objective::mse});
    field = learner.fit_field();
  }
  return estimator.develop_rest();
}
std::shared_ptr<const Proposal> conditional_tree(const Layout& layout) {
  TrainSettings settings;
  settings.seed = 4;
  settings.examples = 16384;
  settings.alpha = 4;
  settings.uniform_share = 0.3;
  const PathIntegrand integrand(box_tracer(), layout, 5);
  return fit(joint_family("kdtree"), gather_candidates(integrand, layout, 5, 65536), settings).proposal;
}

const Spread& plain() {
  static const Spread spread = repeat(64, 90000, [](std::uint64_t seed) {
    ImageEstimator estimator(*box_tracer(), {}, nullptr, seed);
    estimator.add_pass(512);
    return estimator.develop_rest();
  });
  return spread;
}

/// 4.5 standard errors for every pixel and the whole image: a false alarm in 147,000 / 97 choices of seeds.
void expect_mean_of_plain(const Spread& spread) {
  double difference = 0, variance = 0, mean = 0;
  for (std::size_t p = 0; p < spread.sum.size(); ++p) {
    const double v = spread.variance(p) / spread.runs + plain().variance(p) / plain().runs;
    EXPECT_NEAR(spread.mean(p), plain().mean(p), 4.5 * std::sqrt(v)) << "pixel " << p;
    difference += spread.mean(p) - plain().mean(p);
    variance += v;
    mean += plain().mean(p);
  }
  EXPECT_LT(std::fabs(difference), 4.5 * std::sqrt(variance));
  EXPECT_LT(std::sqrt(variance), 0.01 * mean);
}

TEST(Samplers, KeepEveryPixelsMean) {
  for (const Sampler sampler : {Sampler::stratified, Sampler::sobol})
    expect_mean_of_plain(repeat(200, 100, [&](std::uint64_t seed) { return render(sampler, {}, nullptr, 96, seed); }));
}

TEST(Samplers, KeepEveryPixelsMeanUnderAConditionalWarp) {
  const Layout layout = Layout::parse("bounce1.lobe+bounce1");
  const auto warp = conditional_tree(layout);
  for (const Sampler sampler : {Sampler::independent, Sampler::stratified, Sampler::sobol})
    expect_mean_of_plain(repeat(200, 300, [&](std::uint64_t seed) { return render(sampler, layout, warp, 96, seed); }));
}

TEST(Samplers, KeepEveryPixelsMeanUnderAFieldAndAllocation) {
  for (const Sampler sampler : {Sampler::stratified, Sampler::sobol})
    expect_mean_of_plain(repeat(200, 500, [&](std::uint64_t seed) {
      return render_field(sampler, {16, 32, 64}, seed);
    }));
}

TEST(Samplers, SameSeedSameBitsForAnyNumberOfThreads) {
  for (const Sampler sampler : {Sampler::stratified, Sampler::sobol}) {
    const auto bits = [&](int threads) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
      return render_field(sampler, {8, 16}, 7);
    };
    const ImageEstimate one = bits(1), two = bits(2);
    ASSERT_EQ(one.mean.size(), two.mean.size());
    EXPECT_EQ(std::memcmp(one.mean.data(), two.mean.data(), one.mean.size() * sizeof(Color)), 0);
    EXPECT_EQ(std::memcmp(one.variance.data(), two.variance.data(), one.mean.size() * sizeof(Color)), 0);
  }
}

// Both sums are over 96 pixels and 400 images, and meet the same rare paths; 15 % is several standard errors of their
// ratio.
TEST(Samplers, ReplicatesTellTheVarianceThatRepetitionsShow) {
  for (const Sampler sampler : {Sampler::stratified, Sampler::sobol}) {
    const Spread spread = repeat(400, 700, [&](std::uint64_t seed) { return render(sampler, {}, nullptr, 64, seed); });
    double measured = 0, predicted = 0;
    for (std::size_t p = 0; p < spread.sum.size(); ++p) {
      measured += spread.variance(p);
      predicted += spread.predicted[p] / spread.runs;
    }
    EXPECT_NEAR(predicted / measured, 1, 0.15) << sampler_name(sampler);
  }
}

// Edges that cross a grid in any direction; what is smooth, and cells that are not small beside a pixel, are
// overestimated. Second moments would be several times too large.
TEST(Samplers, NeighbouringCellsTellTheVarianceOfDirectlySeenEmission) {
  const Spread spread = repeat(200, 1200, [&](std::uint64_t seed) {
    ImageEstimator estimator(*box_tracer(), {}, nullptr, seed);
    estimator.add_emission_pass(32);
    return estimator.develop_emission();
  });
  double measured = 0, predicted = 0;
  for (std::size_t p = 0; p < spread.sum.size(); ++p) {
    measured += spread.variance(p);
    predicted += spread.predicted[p] / spread.runs;
  }
  ASSERT_GT(measured, 0);
  EXPECT_GT(predicted / measured, 0.7);
  EXPECT_LT(predicted / measured, 1.5);
}

TEST(Samplers, SequencesLessenTheVarianceOfDirectLight) {
  // One bounce has few dimensions: here sequences must show what they are for.
  Scene scene = box_tracer()->scene();
  scene.integrator.max_depth = 2;
  const Tracer tracer(std::move(scene));
  const auto variance = [&](Sampler sampler) {
    const Spread spread = repeat(100, 900, [&](std::uint64_t seed) {
      ImageEstimator estimator(tracer, {}, nullptr, seed, sampler);
      estimator.add_pass(64);
      return estimator.develop_rest();
    });
    double sum = 0;
    for (std::size_t p = 0; p < spread.sum.size(); ++p) sum += spread.variance(p);
    return sum;
  };
  const double independent = variance(Sampler::independent);
  EXPECT_LT(variance(Sampler::sobol), 0.9 * independent);
  EXPECT_LT(variance(Sampler::stratified), 0.9 * independent);
}

}  // namespace
}  // namespace warpath
