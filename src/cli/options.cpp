#include "cli/options.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>

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

void CommonOptions::add_to(CLI::App& app) {
  app.add_option("--size", size, "Size of the film, whatever the scene's parameters are called")->type_name("WxH");
  app.add_option("-D", defines, "Value of a parameter of the scene")->type_name("name=value")->allow_extra_args(false);
  app.add_option("--max-depth", max_depth, "Longest path, counted as Mitsuba does (1: directly seen emission only)")
      ->check(CLI::PositiveNumber);
  app.add_option("--seed", seed, "Same seed, same image, for any number of threads")->capture_default_str();
  app.add_option("--threads", threads, "Threads to use (default: all)")->check(CLI::PositiveNumber);
  auto* loud = app.add_flag("--verbose", verbose, "Tell more");
  app.add_flag("--quiet", quiet, "Show warnings and errors only")->excludes(loud);
}

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

void TrainingOptions::add_to(CLI::App& app) {
  constexpr auto kGroup = "Training";
  const auto add = [&](const char* name, auto& value, const char* help) {
    return app.add_option(name, value, help)->group(kGroup)->capture_default_str();
  };
  auto* by_epp = add("--epp", epp, "Training examples: K x 200 x 160")->check(CLI::PositiveNumber);
  app.add_option("--examples", examples, "Training examples, as a number")
      ->group(kGroup)
      ->check(CLI::PositiveNumber)
      ->excludes(by_epp);
  add("--alpha", settings.alpha, "Candidates for each example, resampled by what they contribute")
      ->check(CLI::Range(1.0, 1e6));
  add("--uniform", settings.uniform, "Share of uniform samples in the mixture; keeps weights bounded")
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--init", init, "Start training from this warp")->group(kGroup)->check(CLI::ExistingFile);
  add("--training-samples", training_samples,
      "Whether candidates count in the image: discard (as the paper does) or use")
      ->check(CLI::IsMember({"discard", "use"}));

  constexpr auto kNvp = "Real NVP";
  const auto add_nvp = [&](const char* name, auto& value, const char* help) {
    return app.add_option(name, value, help)->group(kNvp)->capture_default_str();
  };
  add_nvp("--architecture", m_architecture,
          "default, or released: the authors' 12 couplings of 512 x 8, with their rate")
      ->check(CLI::IsMember({"default", "released"}));
  add_nvp("--couplings", settings.realnvp.couplings, "Coupling layers")->check(CLI::Range(1, 64));
  add_nvp("--width", settings.realnvp.width, "Neurons in each hidden layer")->check(CLI::Range(1, 1024));
  add_nvp("--blocks", settings.realnvp.blocks, "Residual blocks in each network")->check(CLI::Range(0, 64));
  add_nvp("--encoding-bins", settings.realnvp.bins, "Bins of the one-blob encoding of what the networks see; 0: none")
      ->check(CLI::Range(0, 256));
  add_nvp("--masks", m_masks, "What a coupling moves: alternating dimensions, or binary, halves that change")
      ->check(CLI::IsMember({"alternating", "binary"}));
  add_nvp("--loss", m_loss, "What training minimises: variance of the estimate, or likelihood, as the paper does")
      ->check(CLI::IsMember({"variance", "likelihood"}));
  add_nvp("--networks", m_networks, "shared: s and t from one network; separate, as the paper has them")
      ->check(CLI::IsMember({"shared", "separate"}));
  add_nvp("--bn", m_bn, "Normalisation: none, actnorm, or batch (as the paper has it)")
      ->check(CLI::IsMember({"none", "actnorm", "batch"}));
  add_nvp("--rate", settings.realnvp.rate, "Step size of Adam")->check(CLI::PositiveNumber);
  add_nvp("--batch", settings.realnvp.batch, "Examples in a training step")->check(CLI::Range(64, 1 << 20));
  add_nvp("--max-steps", settings.realnvp.max_steps, "Training steps at most")->check(CLI::NonNegativeNumber);

  constexpr auto kTree = "kd-tree and grid";
  app.add_option("--kdtree-target", m_kdtree_target,
                 "A cell's density follows: mean g, or rms, the root of its mean square")
      ->group(kTree)
      ->capture_default_str()
      ->check(CLI::IsMember({"mean", "rms"}));
  app.add_option("--kdtree-split", m_kdtree_split,
                 "best, wherever a split gains most, or cyclic: dimensions in turn, as Guo et al. do")
      ->group(kTree)
      ->capture_default_str()
      ->check(CLI::IsMember({"best", "cyclic"}));
  app.add_option("--leaves", settings.kdtree.max_leaves, "Leaves of the kd-tree at most")
      ->group(kTree)
      ->capture_default_str()
      ->check(CLI::Range(1, 1 << 24));
  app.add_option("--bins", settings.grid.bins, "Intervals of the grid in each dimension")
      ->group(kTree)
      ->capture_default_str()
      ->check(CLI::Range(1, 1 << 16));
}

TrainSettings TrainingOptions::train_settings(std::uint64_t seed) const {
  TrainSettings result = settings;
  result.seed = seed;
  result.examples = examples ? examples : static_cast<std::uint64_t>(std::llround(epp * 200 * 160));
  if (m_architecture == "released") {
    result.realnvp = released_realnvp();
    result.realnvp.batch = settings.realnvp.batch;
    result.realnvp.max_steps = settings.realnvp.max_steps;
  }
  if (m_loss == "likelihood") result.realnvp.loss = RealNvpSettings::Loss::likelihood;
  if (m_networks == "separate") result.realnvp.shared = false;
  if (m_masks == "alternating") result.realnvp.masks = RealNvpSettings::Masks::alternating;
  if (m_bn == "none") result.realnvp.norm = RealNvpSettings::Norm::none;
  if (m_bn == "batch") result.realnvp.norm = RealNvpSettings::Norm::batch;
  result.kdtree.target =
      m_kdtree_target == "rms" ? KdTreeSettings::Target::second_moment : KdTreeSettings::Target::mean;
  if (m_kdtree_split == "cyclic") result.kdtree.split = KdTreeSettings::Split::cyclic;
  return result;
}

void RenderOptions::add_to(CLI::App& app) {
  auto* by_samples =
      app.add_option("--spp", spp, "Samples per pixel (default: the scene's)")->check(CLI::Range(1, 1 << 24));
  app.add_option("--time", time, "Seconds for everything after loading, training included")
      ->check(CLI::PositiveNumber)
      ->excludes(by_samples);
  app.add_option("--crop", crop, "Part of the film to render")->type_name("X,Y,W,H");
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
