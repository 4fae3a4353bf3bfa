#pragma once
#include <tbb/global_control.h>

#include <string>
#include <vector>

#include "cli/commands.h"
#include "estimate/image_estimator.h"
#include "render/method.h"
#include "report/image.h"

namespace warpath {

/// While it lives, no more threads than --threads asks for are used, and messages are as loud as --verbose or --quiet.
class Threads {
 public:
  explicit Threads(const ProcessOptions& options);
  int count() const { return m_count; }

 private:
  int m_count;
  tbb::global_control m_control;
};

/// Of the film, or its part that is rendered: WxH.
std::string size_name(const FilmSettings& film);

enum class Aov { albedo, normal, depth };
/// `albedo,normal`; throws ConfigError on an unknown one.
std::vector<Aov> parse_aovs(const std::string& list);

ImageRgb image_rgb(const ImageEstimate& estimate);
/// Mean, with `variance.R`, `.G`, `.B` (of the mean) and `samples.Y`.
ImageFile image_file(const ImageEstimate& estimate);
/// Attributes that say how the image was made.
void describe(ImageFile& file, const Tracer& tracer, const Method& method, std::uint64_t seed,
              const ImageEstimator& estimator, double seconds);
/// Renders the layers with 16 camera rays a pixel.
void add_aovs(ImageFile& file, const Tracer& tracer, const std::vector<Aov>& aovs, std::uint64_t seed);

}  // namespace warpath
