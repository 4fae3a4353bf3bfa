#include "cli/options.h"

#include <algorithm>
#include <charconv>

#include "scene/scene.h"
#include "warpath/error.h"

namespace warpath {
namespace {

/// `text` as exactly `count` whole numbers with `separator` between them.
std::vector<int> parse_numbers(std::string_view option, const std::string& text, char separator, std::size_t count,
                               std::string_view form) {
  std::vector<int> numbers;
  const char *p = text.data(), *end = text.data() + text.size();
  while (true) {
    int value = 0;
    const auto [next, error] = std::from_chars(p, end, value);
    if (error != std::errc()) break;
    numbers.push_back(value);
    p = next;
    if (p == end || *p != separator) break;
    ++p;
  }
  if (p != end || numbers.size() != count)
    throw ConfigError(fmt::format("{}: \"{}\" is not of the form {}", option, text, form));
  return numbers;
}

}  // namespace

SceneOptions CommonOptions::scene_options() const {
  SceneOptions options;
  for (const std::string& define : defines) {
    const std::size_t equals = define.find('=');
    if (equals == std::string::npos || equals == 0)
      throw ConfigError(fmt::format("-D: \"{}\" is not of the form name=value", define));
    options.defines.emplace_back(define.substr(0, equals), define.substr(equals + 1));
  }
  if (!size.empty()) {
    const auto numbers = parse_numbers("--size", size, 'x', 2, "WxH, such as 320x180");
    constexpr int kLargest = 1 << 15;
    if (std::min(numbers[0], numbers[1]) < 1 || std::max(numbers[0], numbers[1]) > kLargest)
      throw ConfigError(fmt::format("--size: {} is outside 1x1 to {}x{}", size, kLargest, kLargest));
    options.width = numbers[0];
    options.height = numbers[1];
  }
  options.max_depth = max_depth;
  return options;
}

Scene load_scene(const CommonOptions& common, const RenderOptions* render) {
  Scene scene = load_scene(common.scene, common.scene_options());
  if (render && !render->crop.empty()) {
    const auto crop = parse_numbers("--crop", render->crop, ',', 4, "X,Y,W,H");
    FilmSettings& film = scene.film;
    if (crop[0] < 0 || crop[1] < 0 || crop[2] < 1 || crop[3] < 1 || crop[0] + crop[2] > film.width ||
        crop[1] + crop[3] > film.height)
      throw ConfigError(
          fmt::format("--crop: {} is not inside the film of {}x{}", render->crop, film.width, film.height));
    film.crop_x = crop[0];
    film.crop_y = crop[1];
    film.crop_width = crop[2];
    film.crop_height = crop[3];
  }
  return scene;
}

}  // namespace warpath
