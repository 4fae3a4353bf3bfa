#include "render/render_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <limits>

#include "warpath/error.h"

namespace warpath {
namespace {

constexpr int kLargestSide = 1 << 15;
constexpr int kMostSpp = 1 << 24;
constexpr double kMostSeconds = 1e9;

/// N whole numbers from `low` to kLargestSide, with a separator between them.
template <std::size_t N>
OptionValue numbers(std::optional<std::array<int, N>>& value, const char* form, char separator, int low) {
  const std::string domain = fmt::format("{}, each from {} to {}", form, low, kLargestSide);
  const auto set = [&value, domain, separator, low](const std::string& text) {
    std::array<int, N> parsed{};
    const char *p = text.data(), *end = text.data() + text.size();
    for (std::size_t i = 0; i < N; ++i) {
      const auto [rest, error] = std::from_chars(p, end, parsed[i]);
      const bool ends_well = i + 1 < N ? rest != end && *rest == separator : rest == end;
      if (error != std::errc() || !ends_well || parsed[i] < low || parsed[i] > kLargestSide)
        throw ConfigError(fmt::format("\"{}\" is not {}", text, domain));
      p = rest + (i + 1 < N);
    }
    value = parsed;
  };
  const auto get = [&value, separator] {
    return value ? fmt::format("{}", fmt::join(*value, std::string(1, separator))) : std::string();
  };
  return {form, set, get};
}

}  // namespace

std::vector<Option> scene_option_table(SceneRequest& request) {
  return {{"size",
           "Scene",
           "Size of the film, whatever the scene's parameters are called",
           {{"", numbers(request.size, "WxH", 'x', 1)}}},
          {"crop", "Scene", "Part of the film to render", {{"", numbers(request.crop, "X,Y,W,H", ',', 0)}}},
          {"max-depth",
           "Scene",
           "Longest path, counted as Mitsuba does (1: directly seen emission only); 0: the scene's",
           {{"", whole(request.max_depth, 0, std::numeric_limits<int>::max())}}}};
}

std::vector<Option> render_option_table(RenderSettings& settings) {
  return {{"spp", "Render", "Samples per pixel (default: the scene's)", {{"", whole(settings.spp, 1, kMostSpp)}}},
          {"time",
           "Render",
           "Seconds for everything after loading, training included",
           {{"", above(0, settings.time, kMostSeconds)}},
           {"spp"}},
          {"objective",
           "Render",
           "The error that samples are placed to lessen where the film is stratified: mse, relmse, or even for as many "
           "in every pixel; `none` has them even",
           {{"", one_of(settings.objective, {{"mse", std::optional(Objective::mse)},
                                             {"relmse", std::optional(Objective::relmse)},
                                             {"even", std::optional<Objective>()}})}}},
          {"sampler",
           "Render",
           "How the numbers of a pixel's samples are spread, where the film is not warped",
           {{"", one_of(settings.sampler, {{"independent", Sampler::independent},
                                           {"stratified", Sampler::stratified},
                                           {"sobol", Sampler::sobol}})}}},
          {"seed",
           "Render",
           "Same seed, same image, for any number of threads",
           {{"", whole(settings.seed, 0, std::numeric_limits<std::uint64_t>::max())}}}};
}

Scene load_scene(const SceneRequest& request) {
  SceneOptions options;
  options.defines = request.parameters;
  if (request.size) std::tie(options.width, options.height) = std::pair((*request.size)[0], (*request.size)[1]);
  options.max_depth = request.max_depth;
  Scene scene = load_scene(request.file, options);
  if (!request.crop) return scene;
  const auto [x, y, width, height] = *request.crop;
  FilmSettings& film = scene.film;
  if (width < 1 || height < 1 || x + width > film.width || y + height > film.height)
    throw ConfigError(
        fmt::format("crop {},{},{},{} is not inside the film of {}x{}", x, y, width, height, film.width, film.height));
  film.crop_x = x;
  film.crop_y = y;
  film.crop_width = width;
  film.crop_height = height;
  return scene;
}

}  // namespace warpath
