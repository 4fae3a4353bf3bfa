// Passes that learn from those before them, by a field or a network at every vertex and by counts of samples per pixel,
// give the image of plain path tracing, and the same bits for any number of threads.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <map>
#include <memory>

#include "estimate/image_estimator.h"
#include "scene/scene.h"
#include "train/conditional_kdtree_learner.h"
#include "train/conditional_spline_learner.h"
#include "train/field_learner.h"

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
    // Most vertices play roulette.
    scene.integrator.rr_depth = 2;
    tracer = std::make_unique<const Tracer>(std::move(scene));
  }
  return *tracer;
}

/// What is to learn: cells and steps are small, so that a few samples teach much.
std::unique_ptr<VertexLearner> make_learner(const std::string& family, const Tracer& tracer) {
  FieldSettings field;
  field.split_at = 200;
  if (family == "field:bounce1") field.numbers = Layout::parse("bounce1.lobe+bounce1");
  if (family == "field" || family == "field:bounce1") return std::make_unique<FieldLearner>(field, tracer.emitters());
  if (family == "spline:bounce1") {
    ConditionalSplineSettings spline;
    spline.numbers = Layout::parse("bounce1.light+bounce1.light_uv+bounce1.lobe+bounce1");
    spline.flow.batch = 256;
    spline.min_visits = 4096;
    return std::make_unique<ConditionalSplineLearner>(spline, 0.1, 1);
  }
  if (family == "kdtree:bounce1") {
    ConditionalKdTreeSettings tree;
    tree.numbers = Layout::parse("bounce1.light+bounce1.light_uv+bounce1.lobe+bounce1");
    tree.tiles = 4;
    const FilmSettings& film = tracer.scene().film;
    return std::make_unique<ConditionalKdTreeLearner>(tree, film.width, film.height, 0.1);
  }
  return nullptr;
}

/// Passes of `spp` samples per pixel, each guided by those before it.
ImageEstimate guided(const Tracer& tracer, const std::vector<int>& spp, std::optional<Objective> objective,
                     const std::string& family, std::uint64_t seed) {
  ImageEstimator estimator(tracer, {}, nullptr, seed);
  const auto learner = make_learner(family, tracer);
  std::shared_ptr<const VertexProposal> warp;
  for (const int n : spp) {
    estimator.add_guided_pass(n, {warp.get(), learner.get(), objective});
    if (learner) warp = learner->fit();
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

const Spread& reference_of_box() {
  static const Spread spread = plain(box_tracer(12, 8), 64, 512);
  return spread;
}

TEST(Guided, FieldsAndAllocationLeaveEveryPixelsMeanAsItIs) {
  const Tracer& tracer = box_tracer(12, 8);
  for (const auto& [objective, family] : {std::pair{std::optional<Objective>{}, "field"},
                                          {std::optional(Objective::mse), "field:bounce1"},
                                          {std::optional(Objective::relmse), "field"}}) {
    Spread spread;
    for (std::uint64_t seed = 0; seed < 200; ++seed)
      spread.add(guided(tracer, {16, 16, 32, 64}, objective, family, seed));
    expect_same_means(spread, reference_of_box(), 0.01);
  }
}

TEST(Guided, ConditionalFlowsAndTreesLeaveEveryPixelsMeanAsItIs) {
  const Tracer& tracer = box_tracer(12, 8);
  for (const char* family : {"spline:bounce1", "kdtree:bounce1"}) {
    Spread spread;
    for (std::uint64_t seed = 0; seed < 200; ++seed)
      spread.add(guided(tracer, {16, 16, 32, 64}, Objective::relmse, family, seed));
    expect_same_means(spread, reference_of_box(), 0.01);
  }
}

// What a pixel's own fireflies could do to it: with 4 samples a pixel that saw one gets more samples in the pass after,
// and would come out wrong if those weighed more, too (Kirk and Arvo 1991).
TEST(Guided, CountsThatFollowFirefliesDoNotBiasThem) {
  const Tracer& tracer = box_tracer(4, 3);
  const Spread reference = plain(tracer, 64, 16384);
  Spread spread;
  for (std::uint64_t seed = 0; seed < 20000; ++seed) spread.add(guided(tracer, {4, 4}, Objective::mse, "none", seed));
  expect_same_means(spread, reference, 0.005);
}

TEST(Guided, SameSeedSameBitsForAnyNumberOfThreads) {
  for (const char* family : {"field", "spline:bounce1", "kdtree:bounce1"}) {
    const auto bits = [&](int threads) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
      return guided(box_tracer(48, 32), {2, 2, 4, 8}, Objective::relmse, family, 7).mean;
    };
    const auto one = bits(1), two = bits(2), again = bits(2);
    ASSERT_EQ(one.size(), two.size());
    EXPECT_EQ(std::memcmp(one.data(), two.data(), one.size() * sizeof(Color)), 0) << family;
    EXPECT_EQ(std::memcmp(two.data(), again.data(), one.size() * sizeof(Color)), 0) << family;
  }
}

// A warp that helps nothing would pass all else.
TEST(Guided, WarpsLessenTheVariance) {
  const Tracer& tracer = box_tracer(48, 32);
  const auto variance = [&](const VertexProposal* warp) {
    ImageEstimator estimator(tracer, {}, nullptr, 6);
    if (warp)
      estimator.add_guided_pass(64, {warp, nullptr, std::nullopt});
    else
      estimator.add_pass(64);
    double sum = 0;
    for (const Color& v : estimator.develop_rest().variance) sum += luminance(v);
    return sum;
  };
  const double plain_variance = variance(nullptr);
  ImageEstimator estimator(tracer, {}, nullptr, 5);
  FieldLearner learner({}, tracer.emitters());
  std::shared_ptr<const VertexProposal> warp;
  for (int pass = 0; pass < 8; ++pass) {
    estimator.add_guided_pass(64, {nullptr, &learner, std::nullopt});
    warp = learner.fit();
  }
  EXPECT_LT(variance(warp.get()), 0.9 * plain_variance);
}

}  // namespace
}  // namespace warpath
