#pragma once
#include <cstdint>
#include <vector>

#include "core/math.h"
#include "scene/scene.h"

namespace warpath {

/// Mean and variance of the mean, per pixel of the crop window, row-major.
struct ImageEstimate {
  int width = 0, height = 0;
  std::vector<Color> mean;
  std::vector<Color> variance;  ///< of the mean, per channel, from second moments
  std::vector<float> samples;   ///< how many samples fell into the pixel itself
};

/// Where samples become an image: each is splatted through the reconstruction filter, and the weights are divided out.
/// Not thread-safe: batches are added one at a time, in a fixed order, so that sums in double do not depend on threads.
class Film {
 public:
  /// How weights are divided out.
  enum class Weights {
    sampled,  ///< by the sum of the weights that fell there, as Mitsuba does: every pixel has its own samples
    expected  ///< by what uniform film positions would have brought: samples fall where a warp puts them
  };
  Film(const FilmSettings& settings, Weights weights);

  /// One sample at (x, y), in pixels from the corner of the crop window. A value that is not finite counts as 0, stays
  /// in the divisor, and is counted. weight: one over how densely its pixel is sampled, so that pixels with many
  /// samples do not drown their neighbours in filters that reach over; 1 if all are alike.
  void add(float x, float y, const Color& value, float weight = 1);
  /// Samples that fell at (x, y) with value 0 and need no splat under Weights::expected.
  void count(std::uint64_t samples) { m_samples += samples; }

  int width() const { return m_width; }
  int height() const { return m_height; }
  std::uint64_t samples() const { return m_samples; }
  std::uint64_t non_finite() const { return m_non_finite; }
  ImageEstimate develop() const;

 private:
  /// Per pixel: sums over splats with filter weight w and value f.
  struct Sums {
    double wf[3]{};    // w f
    double w = 0;      // w
    double w2f2[3]{};  // (w f)^2
    double w2f[3]{};   // w^2 f
    double w2 = 0;     // w^2
    double count = 0;  // samples inside the pixel
  };
  int m_width, m_height;
  ReconstructionFilter m_filter;
  Weights m_weights;
  std::vector<Sums> m_sums;
  std::vector<double> m_integral_x, m_integral_y;
  std::vector<float> m_weight_x, m_weight_y;  // scratch of one splat
  std::uint64_t m_samples = 0, m_non_finite = 0;
};

}  // namespace warpath
