#include "estimate/film.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "core/rng.h"
#include "estimate/film_positions.h"
#include "estimate/reconstruction.h"

namespace warpath {
namespace {

FilmSettings settings(int width, int height, ReconstructionFilter::Type type, float radius) {
  FilmSettings s;
  s.width = s.crop_width = width;
  s.height = s.crop_height = height;
  s.filter.type = type;
  s.filter.radius = radius;
  return s;
}
using Type = ReconstructionFilter::Type;

TEST(Reconstruction, FiltersAreSymmetricAndEndAtTheirRadius) {
  for (const auto& [type, radius] :
       {std::pair{Type::box, 0.5f}, {Type::tent, 1.0f}, {Type::gaussian, 2.0f}, {Type::mitchell, 2.0f}}) {
    ReconstructionFilter filter;
    filter.type = type;
    filter.radius = radius;
    EXPECT_GT(filter_weight(filter, 0), 0);
    for (float x = 0; x < 3; x += 0.01f) {
      EXPECT_EQ(filter_weight(filter, x), filter_weight(filter, -x));
      if (x > radius) {
        EXPECT_NEAR(filter_weight(filter, x), 0, 1e-7);
      }
    }
  }
}

TEST(Reconstruction, MitchellIntegratesToOneAndGaussianToItsClosedForm) {
  ReconstructionFilter mitchell;
  mitchell.type = Type::mitchell;
  EXPECT_NEAR(filter_integrals(mitchell, 9)[4], 1, 1e-5);
  ReconstructionFilter gaussian;
  gaussian.type = Type::gaussian;
  gaussian.radius = 2;
  gaussian.stddev = 0.5f;
  const double whole = 0.5 * std::sqrt(2 * M_PI) * std::erf(2 / (0.5 * std::sqrt(2.0))) - 4 * std::exp(-8.0);
  EXPECT_NEAR(filter_integrals(gaussian, 9)[4], whole, 1e-5);
  // At the border half a pixel more than half of the filter lies on the film.
  EXPECT_LT(filter_integrals(gaussian, 9)[0], 0.95 * whole);
}

TEST(Film, ConstantImageStaysConstantUnderEveryFilter) {
  for (const auto& [type, radius] :
       {std::pair{Type::box, 0.5f}, {Type::tent, 1.0f}, {Type::gaussian, 2.0f}, {Type::mitchell, 2.0f}}) {
    Film film(settings(7, 5, type, radius), Film::Weights::sampled);
    for (std::uint32_t i = 0; i < 7 * 5 * 64; ++i) {
      const std::uint32_t p = i % 35;
      const std::uint64_t key = sample_key(1, i);
      film.add(static_cast<float>(p % 7) + sample_float(key, 0), static_cast<float>(p / 7) + sample_float(key, 1),
               Color(2, 3, 4));
    }
    const ImageEstimate image = film.develop();
    for (std::size_t p = 0; p < 35; ++p) {
      EXPECT_NEAR(image.mean[p].x, 2, 1e-5);
      EXPECT_NEAR(image.mean[p].z, 4, 1e-5);
      EXPECT_NEAR(image.variance[p].y, 0, 9 * 0x1p-24f);  // what tells errors is summed in float
      EXPECT_EQ(image.samples[p], 64);
    }
  }
}

TEST(Film, TakesTheImageThatItWouldDevelop) {
  Film film(settings(200, 130, Type::tent, 1), Film::Weights::sampled);  // more than take() does at once
  for (std::uint32_t i = 0; i < 40000; ++i) {
    const std::uint64_t key = sample_key(3, i);
    const float x = sample_float(key, 0);
    film.add(200 * x, 130 * sample_float(key, 1), Color(x, 1, sample_float(key, 2)));
  }
  const ImageEstimate expected = film.develop(), taken = film.take();
  EXPECT_EQ(taken.width, 200);
  EXPECT_EQ(taken.height, 130);
  EXPECT_EQ(taken.mean, expected.mean);
  EXPECT_EQ(taken.variance, expected.variance);
  EXPECT_EQ(taken.samples, expected.samples);
}

/// Error of each pixel over its own estimated standard error, for a known image f(x, y) = 1 + x and random film
/// positions of density q(x) = (0.5 + x / width) / 1.
TEST(Film, ExpectedWeightsAreUnbiasedAndTheirVarianceIsRight) {
  constexpr int kWidth = 6, kHeight = 4, kRuns = 400, kSamples = 2000;
  for (const auto& [type, radius] : {std::pair{Type::box, 0.5f}, {Type::tent, 1.0f}, {Type::gaussian, 2.0f}}) {
    const FilmSettings s = settings(kWidth, kHeight, type, radius);
    std::vector<double> sum(kWidth * kHeight), sum2(kWidth * kHeight), variance(kWidth * kHeight);
    for (int run = 0; run < kRuns; ++run) {
      Film film(s, Film::Weights::expected);
      for (int i = 0; i < kSamples; ++i) {
        const std::uint64_t key = sample_key(static_cast<std::uint64_t>(run), static_cast<std::uint64_t>(i));
        // Inverse of the cumulative distribution x / 2 + x^2 / 2.
        const double u = sample_double(key, 0), x = std::sqrt(0.25 + 2 * u) - 0.5, q = 0.5 + x;
        const float value = static_cast<float>((1 + x * kWidth) / q);
        film.add(static_cast<float>(x * kWidth), sample_float(key, 1) * kHeight, Color(value));
      }
      const ImageEstimate image = film.develop();
      for (std::size_t p = 0; p < sum.size(); ++p) {
        sum[p] += image.mean[p].x;
        sum2[p] += sqr(image.mean[p].x);
        variance[p] += image.variance[p].x;
      }
    }
    for (int p = 0; p < kWidth * kHeight; ++p) {
      const double mean = sum[p] / kRuns, spread = sum2[p] / kRuns - mean * mean;
      // Filter-weighted mean of 1 + x over the film, by quadrature.
      double expected = 0, weight = 0;
      for (double x = 0.0005; x < kWidth; x += 0.001) {
        const double w = s.filter.type == Type::box
                             ? (static_cast<int>(x) == p % kWidth ? 1 : 0)
                             : filter_weight(s.filter, static_cast<float>(x - (p % kWidth + 0.5)));
        expected += w * (1 + x);
        weight += w;
      }
      expected /= weight;
      // 72 z-tests in all at 4.5 standard errors: false alarms in 5 of 10,000 runs.
      EXPECT_NEAR(mean, expected, 4.5 * std::sqrt(spread / kRuns)) << "pixel " << p << ", radius " << radius;
      // The ratio of variances has a standard error of about sqrt(2 / 400) = 7 %.
      EXPECT_NEAR(variance[p] / kRuns / spread, 1, 0.35) << "pixel " << p << ", radius " << radius;
    }
  }
}

TEST(Film, ReplicatesTellTheVarianceOfSamplesThatDependOnEachOther) {
  // All samples that a pixel has in one replicate are equal, so that second moments see a fourth of the variance; the
  // tent mixes pixels.
  constexpr int kWidth = 5, kHeight = 4, kRuns = 400, kEach = 4;
  double measured = 0, replicates = 0, moments = 0;
  std::vector<double> sum(kWidth * kHeight), sum2(kWidth * kHeight);
  for (std::uint64_t run = 0; run < kRuns; ++run) {
    const FilmSettings s = settings(kWidth, kHeight, Type::tent, 1);
    Film film(s, Film::Weights::sampled, Film::Errors::replicates), plain(s, Film::Weights::sampled);
    for (std::uint32_t p = 0; p < kWidth * kHeight; ++p)
      for (std::uint32_t i = 0; i < kEach * kReplicates; ++i) {
        const std::uint32_t r = i % kReplicates;
        const std::uint64_t key = sample_key(run, p * kReplicates + r);
        const float x = static_cast<float>(p % kWidth) + sample_float(key, 0),
                    y = static_cast<float>(p / kWidth) + sample_float(key, 1);
        const Color value(1 + 2 * sample_float(key, 2));
        film.add(x, y, value, 1, r);
        plain.add(x, y, value);
      }
    const ImageEstimate image = film.develop(), of_moments = plain.develop();
    for (std::size_t p = 0; p < sum.size(); ++p) {
      EXPECT_EQ(image.mean[p].x, of_moments.mean[p].x);
      sum[p] += image.mean[p].x;
      sum2[p] += sqr(image.mean[p].x);
      replicates += image.variance[p].x / kRuns;
      moments += of_moments.variance[p].x / kRuns;
    }
  }
  for (std::size_t p = 0; p < sum.size(); ++p) measured += sum2[p] / kRuns - sqr(static_cast<float>(sum[p] / kRuns));
  // 20 variances of 400 values each, of which neighbours share much: a standard error of about 3 %.
  EXPECT_NEAR(replicates / measured, 1, 0.12);
  EXPECT_LT(moments / measured, 0.4);
}

TEST(Film, PixelsWithFewerSamplesThanReplicatesFallBackToSecondMoments) {
  const FilmSettings s = settings(1, 1, Type::box, 0.5f);
  Film film(s, Film::Weights::sampled, Film::Errors::replicates), plain(s, Film::Weights::sampled);
  for (std::uint32_t i = 0; i < kReplicates - 1; ++i) {
    film.add(0.5f, 0.5f, Color(static_cast<float>(i)), 1, i);
    plain.add(0.5f, 0.5f, Color(static_cast<float>(i)));
  }
  EXPECT_GT(film.develop().variance[0].x, 0);
  EXPECT_EQ(film.develop().variance[0].x, plain.develop().variance[0].x);
}

TEST(Film, NonFiniteSamplesCountAsZeroAndStayInTheDivisor) {
  Film film(settings(1, 1, Type::box, 0.5f), Film::Weights::sampled);
  const float infinity = std::numeric_limits<float>::infinity();
  film.add(0.5f, 0.5f, Color(3.0f));
  film.add(0.5f, 0.5f, Color(infinity, 0, 0));
  film.add(0.5f, 0.5f, Color(0, std::nanf(""), 0));
  EXPECT_EQ(film.non_finite(), 2u);
  EXPECT_FLOAT_EQ(film.develop().mean[0].x, 1);
}

TEST(FilmPositions, StayInsideTheirPixel) {
  for (const int size : {1, 3, 320, 1280, 32768})
    for (std::uint32_t pixel = 0; pixel < static_cast<std::uint32_t>(size);
         pixel += 1 + static_cast<std::uint32_t>(size) / 97) {
      for (const float offset : {0.0f, 0.5f, kOneMinusEpsilon}) {
        const float x = film_position(pixel, offset, size);
        EXPECT_LT(x, 1);
        EXPECT_NEAR(x * static_cast<float>(size), static_cast<float>(pixel) + offset, 4e-3);
      }
    }
}

}  // namespace
}  // namespace warpath
