#pragma once
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "report/image.h"

namespace warpath {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// How far an image I is from a reference R. Every figure is a mean over pixels and channels of linear RGB:
///   mse = (I - R)^2;  relmse = (I - R)^2 / (R^2 + 0.01);  mape = |I - R| / (|R| + 0.01), a fraction;
///   relmse_trimmed = relmse without the 0.1 % of pixels (rounded up) where it is largest.
/// The reference's own noise, mean(var) or mean(var / (R^2 + 0.01)), is subtracted where its variance is known, from
/// all but mape; the results may therefore be slightly negative. `_raw` are the unsubtracted figures. NaN: not known.
struct ImageErrors {
  double mse = kUnknown;
  double relmse = kUnknown;
  double relmse_trimmed = kUnknown;
  double mape = kUnknown;
  double mse_raw = kUnknown;
  double relmse_raw = kUnknown;
};

/// The reference and its variance must have the image's size. Sums are in double; a NaN in the image makes the figures
/// NaN.
ImageErrors image_errors(const ImageRgb& image, const Reference& reference);

/// Mean of each channel over all pixels.
std::array<double, 3> image_mean(const ImageRgb& image);

/// A mean over runs. The standard error of that mean is NaN for a single run: one run tells nothing about spread.
struct Estimate {
  double value = kUnknown;
  double standard_error = kUnknown;
};

Estimate mean_over_runs(std::span<const double> runs);

/// (mean over runs of the baseline) / (mean over runs of the method), its standard error to first order in those of the
/// two means, whose runs are independent. Above 1: the method has less error. NaN where a mean is not above 0, so that
/// no ratio makes sense.
Estimate gain(std::span<const double> baseline, std::span<const double> method);

}  // namespace warpath
