#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/math.h"

namespace warpath {

/// The error that a user wants small.
enum class Objective : std::uint8_t { mse, relmse };

/// Moments of the samples of each pixel, of their own light and not their neighbours'.
class PixelMoments {
 public:
  PixelMoments(int width, int height);
  /// A sample of a pixel; not finite counts as 0.
  void add(std::uint32_t pixel, const Color& value);
  /// Number of samples for each pixel in a pass of `spp` samples per pixel on average: at least one each, the others
  /// where they lessen the error most, as far as the moments can tell. The sum is spp x pixels to within one. u in
  /// [0,1) decides where fractions of samples go.
  ///
  /// Counts go with the standard deviation of a pixel's samples, over what the error divides by (Neyman 1934, optimal
  /// allocation). They do not bias the image if each pass weighs the same in every pixel.
  std::vector<std::uint32_t> allocate(int spp, Objective objective, double u) const;
  /// The error that one sample per pixel on average would have: with the best allocation for the objective, or, without
  /// one, relMSE with as many in every pixel. What relMSE divides by is taken from `means`.
  double error(std::optional<Objective> objective, const PixelMoments& means) const;
  /// Luminance of each pixel, pooled over its neighbours; 0 where nothing was found yet.
  std::vector<float> brightness() const;
  PixelMoments& operator+=(const PixelMoments& other);

 private:
  struct Moments {
    double n = 0, sum[3]{}, square[3]{};
  };
  /// For each pixel the standard deviation of one sample over what the error divides by, pooled over its neighbours.
  std::vector<double> deviations(Objective objective, const PixelMoments& means) const;

  int m_width, m_height;
  std::vector<Moments> m_moments;
};

}  // namespace warpath
