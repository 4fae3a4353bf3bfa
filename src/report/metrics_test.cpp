#include "report/metrics.h"

#include <gtest/gtest.h>

#include <random>

#include "warpath/error.h"

namespace warpath {
namespace {

TEST(image_errors, of_a_constant_difference_are_those_of_the_definition) {
  const ImageRgb image(4, 3, Color(0.5f, 1.0f, 0.25f));
  const Reference reference{"", ImageRgb(4, 3, Color(0.25f, 0.5f, 0.25f)), {}};
  const ImageErrors errors = image_errors(image, reference);
  EXPECT_DOUBLE_EQ(errors.mse, (0.0625 + 0.25) / 3);
  EXPECT_DOUBLE_EQ(errors.relmse, (0.0625 / 0.0725 + 0.25 / 0.26) / 3);
  EXPECT_DOUBLE_EQ(errors.relmse_trimmed, errors.relmse);
  EXPECT_DOUBLE_EQ(errors.mape, (0.25 / 0.26 + 0.5 / 0.51) / 3);
  EXPECT_DOUBLE_EQ(errors.mse_raw, errors.mse);
  EXPECT_DOUBLE_EQ(errors.relmse_raw, errors.relmse);
}

TEST(image_errors, subtract_the_noise_of_the_reference_from_all_but_the_raw_figures) {
  const ImageRgb image(10, 10, Color(2.0f));
  const Reference reference{"", ImageRgb(10, 10, Color(1.0f)), ImageRgb(10, 10, Color(0.25f))};
  const ImageErrors errors = image_errors(image, reference);
  EXPECT_DOUBLE_EQ(errors.mse_raw, 1.0);
  EXPECT_DOUBLE_EQ(errors.mse, 0.75);
  EXPECT_NEAR(errors.relmse_raw, 1.0 / 1.01, 1e-12);
  EXPECT_NEAR(errors.relmse, 0.75 / 1.01, 1e-12);
  EXPECT_NEAR(errors.relmse_trimmed, 0.75 / 1.01, 1e-12);
}

TEST(image_errors, trimming_drops_the_worst_pixels_alone) {
  ImageRgb image(50, 40, Color(1.5f));  // 2,000 pixels: two are dropped
  image.at(3, 5) = image.at(49, 39) = Color(1000.0f);
  const Reference reference{"", ImageRgb(50, 40, Color(1.0f)), {}};
  const ImageErrors errors = image_errors(image, reference);
  EXPECT_NEAR(errors.relmse_trimmed, 0.25 / 1.01, 1e-12);
  EXPECT_GT(errors.relmse, 900.0);
  image.at(4, 5) = Color(1000.0f);
  EXPECT_GT(image_errors(image, reference).relmse_trimmed, 400.0);
}

// The subtraction makes the measured error that of the image alone. 40,000 pixels, true MSE 0.04: the standard error of
// the estimate is under 0.0005, the bound is 5 of them (two-sided false-alarm rate 6e-7; the seed is fixed).
TEST(image_errors, against_a_noisy_reference_are_those_against_the_truth) {
  std::mt19937 rng(7);
  std::normal_distribution<float> normal;
  ImageRgb image(200, 200), noisy(200, 200);
  const ImageRgb variance(200, 200, Color(0.01f));
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      image.pixels[i][c] = 1 + 0.2f * normal(rng);
      noisy.pixels[i][c] = 1 + 0.1f * normal(rng);
    }
  const ImageErrors errors = image_errors(image, {"", noisy, variance});
  EXPECT_NEAR(errors.mse, 0.04, 0.0025);
  EXPECT_NEAR(errors.mse_raw, 0.05, 0.0025);
}

TEST(image_errors, of_an_image_with_nan_are_nan) {
  ImageRgb image(4, 4, Color(1.0f));
  image.at(1, 1) = Color(0.0f, kUnknown, 0.0f);
  const ImageErrors errors = image_errors(image, {"", ImageRgb(4, 4), {}});
  EXPECT_TRUE(std::isnan(errors.mse));
  EXPECT_TRUE(std::isnan(errors.relmse));
  EXPECT_TRUE(std::isnan(errors.relmse_trimmed));
}

TEST(image_errors, need_images_of_one_size) {
  EXPECT_THROW(image_errors(ImageRgb(4, 4), {"", ImageRgb(4, 3), {}}), InternalError);
  EXPECT_THROW(image_errors(ImageRgb(4, 4), {"", ImageRgb(4, 4), ImageRgb(3, 4)}), InternalError);
}

TEST(image_mean, is_per_channel) {
  ImageRgb image(2, 1, Color(1.0f, 2.0f, 3.0f));
  image.at(1, 0) = Color(3.0f, 2.0f, 1.0f);
  EXPECT_EQ(image_mean(image), (std::array<double, 3>{2, 2, 2}));
}

TEST(mean_over_runs, has_the_standard_error_of_the_mean) {
  const double runs[] = {1, 2, 3, 6};
  const Estimate estimate = mean_over_runs(runs);
  EXPECT_DOUBLE_EQ(estimate.value, 3.0);
  EXPECT_DOUBLE_EQ(estimate.standard_error, std::sqrt(14.0 / 3.0 / 4.0));
  EXPECT_TRUE(std::isnan(mean_over_runs(std::span(runs, 1)).standard_error));
  EXPECT_TRUE(std::isnan(mean_over_runs({}).value));
}

TEST(gain, is_the_ratio_of_means) {
  const double baseline[] = {4, 6};
  const double method[] = {1, 3};
  const Estimate estimate = gain(baseline, method);
  EXPECT_DOUBLE_EQ(estimate.value, 2.5);
  EXPECT_DOUBLE_EQ(estimate.standard_error, 2.5 * std::hypot(1.0 / 5, 1.0 / 2));
  EXPECT_TRUE(std::isnan(gain(std::span(baseline, 1), std::span(method, 1)).standard_error));
}

// The first-order standard error against the spread of simulated gains: 20,000 comparisons of 4 runs each with 5 %
// noise. The simulated spread has a relative standard error of 0.5 %, higher orders add under 1 %; the bound is 5 %.
TEST(gain, standard_error_is_the_spread_of_gains) {
  std::mt19937 rng(11);
  std::normal_distribution<double> noise(1.0, 0.05);
  std::vector<double> gains;
  double claimed_variance = 0;
  for (int i = 0; i < 20000; ++i) {
    std::array<double, 4> a, b;
    for (double& x : a) x = 3 * noise(rng);
    for (double& x : b) x = 2 * noise(rng);
    const Estimate estimate = gain(a, b);
    gains.push_back(estimate.value);
    claimed_variance += estimate.standard_error * estimate.standard_error / 20000;
  }
  const double spread = mean_over_runs(gains).standard_error * std::sqrt(20000.0);
  EXPECT_NEAR(std::sqrt(claimed_variance) / spread, 1.0, 0.05);
}

TEST(gain, is_unknown_where_no_ratio_makes_sense) {
  const double negative[] = {-0.1};
  const double positive[] = {1.0};
  EXPECT_TRUE(std::isnan(gain(positive, negative).value));
  EXPECT_TRUE(std::isnan(gain(negative, positive).value));
  EXPECT_TRUE(std::isnan(gain({}, positive).value));
}

}  // namespace
}  // namespace warpath
