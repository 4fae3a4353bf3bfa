#include "report/metrics.h"

#include <algorithm>
#include <vector>

#include "warpath/error.h"

namespace warpath {
namespace {

/// A pixel's relative squared error and the share of it that the reference's noise makes; both are sums over channels.
struct RelativeError {
  double raw = 0;
  double noise = 0;
};

void check_same_size(const ImageRgb& a, const ImageRgb& b) {
  WARPATH_CHECK_EQ(a.width, b.width);
  WARPATH_CHECK_EQ(a.height, b.height);
}

}  // namespace

ImageErrors image_errors(const ImageRgb& image, const Reference& reference) {
  check_same_size(image, reference.image);
  if (reference.variance) check_same_size(image, *reference.variance);
  WARPATH_CHECK(!image.empty());

  const std::size_t pixel_count = image.pixels.size();
  std::vector<RelativeError> relative(pixel_count);
  double squared = 0;
  double squared_noise = 0;
  double percentage = 0;
  for (std::size_t i = 0; i < pixel_count; ++i)
    for (int c = 0; c < 3; ++c) {
      const double r = reference.image.pixels[i][c];
      const double difference = image.pixels[i][c] - r;
      const double variance = reference.variance ? reference.variance->pixels[i][c] : 0.0;
      squared += difference * difference;
      squared_noise += variance;
      percentage += std::abs(difference) / (std::abs(r) + 0.01);
      relative[i].raw += difference * difference / (r * r + 0.01);
      relative[i].noise += variance / (r * r + 0.01);
    }

  const double count = 3.0 * static_cast<double>(pixel_count);
  ImageErrors errors;
  errors.mse_raw = squared / count;
  errors.mse = (squared - squared_noise) / count;
  errors.mape = percentage / count;
  if (!std::isfinite(squared)) return errors;  // NaN has no place in an order, and relmse would be NaN anyway.

  const auto sum = [&](std::size_t pixels) {
    RelativeError total;
    for (std::size_t i = 0; i < pixels; ++i) {
      total.raw += relative[i].raw;
      total.noise += relative[i].noise;
    }
    return total;
  };
  const RelativeError all = sum(pixel_count);
  errors.relmse_raw = all.raw / count;
  errors.relmse = (all.raw - all.noise) / count;

  const std::size_t kept = pixel_count - (pixel_count + 999) / 1000;
  if (kept > 0) {
    std::nth_element(relative.begin(), relative.begin() + kept, relative.end(),
                     [](const RelativeError& a, const RelativeError& b) { return a.raw < b.raw; });
    const RelativeError trimmed = sum(kept);
    errors.relmse_trimmed = (trimmed.raw - trimmed.noise) / (3.0 * static_cast<double>(kept));
  }
  return errors;
}

std::array<double, 3> image_mean(const ImageRgb& image) {
  std::array<double, 3> mean{};
  for (const Color& pixel : image.pixels)
    for (int c = 0; c < 3; ++c) mean[c] += pixel[c];
  for (double& m : mean) m /= static_cast<double>(image.pixels.size());
  return mean;
}

Estimate mean_over_runs(std::span<const double> runs) {
  if (runs.empty()) return {};
  const double n = static_cast<double>(runs.size());
  double mean = 0;
  for (const double x : runs) mean += x / n;
  double squares = 0;
  for (const double x : runs) squares += (x - mean) * (x - mean);
  return {mean, runs.size() > 1 ? std::sqrt(squares / (n * (n - 1))) : kUnknown};
}

Estimate gain(std::span<const double> baseline, std::span<const double> method) {
  const Estimate a = mean_over_runs(baseline);
  const Estimate b = mean_over_runs(method);
  if (!(a.value > 0) || !(b.value > 0)) return {};
  const double ratio = a.value / b.value;
  return {ratio, ratio * std::hypot(a.standard_error / a.value, b.standard_error / b.value)};
}

}  // namespace warpath
