#include "cli/output.h"

#include <spdlog/spdlog.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>

#include "estimate/first_hit_estimator.h"
#include "scene/scene.h"
#include "warpath/error.h"

namespace warpath {

Threads::Threads(const ProcessOptions& options)
    : m_count(options.threads.value_or(tbb::this_task_arena::max_concurrency())),
      m_control(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(m_count)) {
  if (options.quiet) spdlog::set_level(spdlog::level::warn);
  if (options.verbose) spdlog::set_level(spdlog::level::debug);
}

std::string size_name(const FilmSettings& film) { return fmt::format("{}x{}", film.crop_width, film.crop_height); }

std::vector<Aov> parse_aovs(const std::string& list) {
  constexpr std::array<std::string_view, 3> kNames{"albedo", "normal", "depth"};
  std::vector<Aov> aovs;
  for (std::size_t begin = 0; begin < list.size();) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    const std::string_view name = std::string_view(list).substr(begin, end - begin);
    const auto found = std::find(kNames.begin(), kNames.end(), name);
    if (found == kNames.end())
      throw ConfigError(fmt::format("--aov: unknown layer \"{}\";{}", name, suggestion(name, kNames)));
    aovs.push_back(static_cast<Aov>(found - kNames.begin()));
    begin = end + 1;
  }
  return aovs;
}

ImageRgb image_rgb(const ImageEstimate& estimate) {
  ImageRgb image(estimate.width, estimate.height);
  image.pixels = estimate.mean;
  return image;
}

ImageFile image_file(const ImageEstimate& estimate) {
  ImageFile file;
  file.image = image_rgb(estimate);
  ImageRgb variance(estimate.width, estimate.height);
  variance.pixels = estimate.variance;
  file.add_layer("variance", variance);
  file.add_layer("samples", estimate.samples);
  return file;
}

void describe(ImageFile& file, const Tracer& tracer, const Method& method, std::uint64_t seed,
              const ImageEstimator& estimator, double seconds) {
  auto& attributes = file.attributes;
  attributes["warpath:version"] = std::string(WARPATH_VERSION);
  attributes["warpath:scene"] = tracer.scene().file.filename().string();
  attributes["warpath:method"] = method.name;
  attributes["warpath:dims"] = method.layout.name();
  attributes["warpath:sampler"] = std::string(sampler_name(estimator.sampler()));
  attributes["warpath:seed"] = std::to_string(seed);
  attributes["warpath:spp"] = static_cast<float>(estimator.spp());
  attributes["warpath:max_depth"] = tracer.scene().integrator.max_depth;
  attributes["warpath:seconds"] = static_cast<float>(seconds);
  attributes["warpath:non_finite"] = static_cast<int>(std::min<std::uint64_t>(estimator.non_finite(), 1u << 30));
}

void add_aovs(ImageFile& file, const Tracer& tracer, const std::vector<Aov>& aovs, std::uint64_t seed) {
  if (aovs.empty()) return;
  constexpr int kRays = 16;
  const FirstHitImages images = estimate_first_hits(tracer, kRays, seed);
  const auto as_image = [&](const std::vector<Color>& pixels) {
    ImageRgb image(file.image.width, file.image.height);
    image.pixels = pixels;
    return image;
  };
  for (const Aov aov : aovs) {
    if (aov == Aov::albedo) file.add_layer("albedo", as_image(images.albedo));
    if (aov == Aov::normal) file.add_layer("normal", as_image(images.normal), "XYZ");
    if (aov == Aov::depth) file.add_layer("depth", images.depth);
  }
}

}  // namespace warpath
