#pragma once
#include <cstdint>
#include <vector>

#include "core/math.h"
#include "core/zeroed_array.h"
#include "scene/scene.h"

namespace warpath {

/// Mean and variance of the mean, per pixel of the crop window, row-major.
struct ImageEstimate {
  int width = 0, height = 0;
  std::vector<Color> mean;
  std::vector<Color> variance;  ///< of the mean, per channel, as the film's errors tell it
  std::vector<float> samples;   ///< how many samples fell into the pixel itself
};

/// Groups of samples whose spread tells the variance of what they share.
inline constexpr std::uint32_t kReplicates = 8;

/// Where samples become an image: each is splatted through the reconstruction filter, and the weights are divided out.
/// Not thread-safe: batches are added one at a time, in a fixed order, so that sums in double do not depend on threads.
class Film {
 public:
  /// How weights are divided out.
  enum class Weights {
    sampled,  ///< by the sum of the weights that fell there, as Mitsuba does: every pixel has its own samples
    expected  ///< by what uniform film positions would have brought: samples fall where a warp puts them
  };
  /// What tells the variance of the mean.
  enum class Errors {
    moments,     ///< second moments: samples are independent
    replicates,  ///< the spread of kReplicates groups of samples: those of a group may depend on each other
    neighbours   ///< differences of samples from neighbouring strata, see add_neighbours
  };
  /// replicates are for Weights::sampled.
  Film(const FilmSettings& settings, Weights weights, Errors errors = Errors::moments);

  /// One sample at (x, y), in pixels from the corner of the crop window. A value that is not finite counts as 0, stays
  /// in the divisor, and is counted. weight: one over how densely its pixel is sampled, so that pixels with many
  /// samples do not drown their neighbours in filters that reach over; 1 if all are alike. replicate: the group of the
  /// sample, below kReplicates. Samples of different groups must be independent, in a pixel and across pixels. A pixel
  /// with fewer samples than groups falls back to second moments, as if its samples were independent.
  void add(float x, float y, const Color& value, float weight = 1, std::uint32_t replicate = 0);
  /// Tells the variance of samples that lie one in each cell of a grid, which are far more even than independent ones:
  /// a and b are samples from neighbouring cells, both added before, and `share` times their difference squared goes
  /// into the sum of the samples' variances.
  struct Sample {
    float x, y;
    Color value;
  };
  void add_neighbours(const Sample& a, const Sample& b, double share);
  /// Samples that fell at (x, y) with value 0 and need no splat under Weights::expected.
  void count(std::uint64_t samples) { m_samples += samples; }

  int width() const { return m_width; }
  int height() const { return m_height; }
  std::uint64_t samples() const { return m_samples; }
  std::uint64_t non_finite() const { return m_non_finite; }
  ImageEstimate develop() const;
  /// The same for the last time: sums go as pixels come, so that a large film and its image need not fit together.
  ImageEstimate take();
  /// Adds means and variances to those of an image of the same size, which is of independent samples.
  void develop_onto(ImageEstimate& image) const;

 private:
  /// Per pixel: sums over splats with filter weight w and value f. One cache line. What makes up the mean is in double;
  /// what tells its error need not be.
  struct alignas(64) Sums {
    double wf[3]{};           // w f
    double w = 0;             // w
    float w2f2[3]{};          // (w f)^2
    float w2f[3]{};           // w^2 f
    float w2 = 0;             // w^2
    std::uint32_t count = 0;  // samples inside the pixel
  };
  static_assert(sizeof(Sums) == 64);
  /// Sums over the splats of one replicate. In float: only their spread counts.
  struct Replicate {
    float wf[3]{}, w = 0;
  };
  /// The pixels that one position reaches, and its weight there along each axis.
  struct Splat {
    int x0 = 0, x1 = 0, y0 = 0, y1 = 0;
    std::vector<float> x, y;
    float weight(int i, int j) const {
      if (i < x0 || i > x1 || j < y0 || j > y1) return 0;
      return x[static_cast<std::size_t>(i - x0)] * y[static_cast<std::size_t>(j - y0)];
    }
  };
  void develop(std::size_t begin, std::size_t end, ImageEstimate& image) const;
  void place(float x, float y, float weight, Splat& splat) const;
  /// Mean of a channel of a pixel, and its variance; false if nothing has fallen there.
  bool develop(std::size_t pixel, int channel, double& mean, double& variance) const;

  int m_width, m_height;
  ReconstructionFilter m_filter;
  Weights m_weights;
  Errors m_errors;
  ZeroedArray<Sums> m_sums;
  std::vector<double> m_integral_x, m_integral_y;
  Splat m_splat, m_other;  // scratch
  std::uint64_t m_samples = 0, m_non_finite = 0;
  std::vector<Replicate> m_replicates;  // kReplicates for each pixel; empty without
};

}  // namespace warpath
