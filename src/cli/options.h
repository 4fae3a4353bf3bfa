#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/latents.h"
#include "estimate/allocation.h"
#include "warpath/layout.h"
#include "warpath/train.h"

namespace warpath {

struct Scene;
struct SceneOptions;

/// Options that all commands share.
struct CommonOptions {
  std::filesystem::path scene;
  std::string size;                  ///< WxH
  std::vector<std::string> defines;  ///< name=value
  int max_depth = 0;
  std::uint64_t seed = 0;
  int threads = 0;  ///< 0: all
  bool verbose = false, quiet = false;

  SceneOptions scene_options() const;  ///< throws ConfigError on a malformed --size or -D
};

/// Options of commands that train.
struct TrainingOptions {
  double epp = 16;
  std::uint64_t examples = 0;  ///< 0: epp x 200 x 160
  std::filesystem::path init;
  std::string training_samples = "discard";  ///< or use: candidates count in the image
  TrainSettings settings;
  // Choices by name, as they are typed; train_settings puts them into the settings.
  std::string bn = "actnorm", masks = "binary", architecture = "default";
  std::string loss = "variance", networks = "shared";
  std::string kdtree_target = "rms", kdtree_split = "best";
  // Of both flows, and of spline and grid; what is not given is the family's own default.
  std::optional<int> couplings, width, blocks, encoding_bins, batch, max_steps, bins;
  std::optional<double> rate;

  TrainSettings train_settings(std::uint64_t seed) const;
  bool use_samples() const { return training_samples == "use"; }
};

/// Options of commands that render.
struct RenderOptions {
  std::optional<int> spp;
  std::optional<double> time;
  std::string crop;                         ///< X,Y,W,H
  std::string aov;                          ///< albedo,normal,depth
  std::string objective_name = "relmse";    ///< mse, relmse or even
  std::optional<std::string> sampler_name;  ///< independent, stratified or sobol

  std::optional<Objective> objective() const;  ///< none for `even`
  /// The sampler of a method with this layout. Throws ConfigError if what was asked for does not go with it.
  Sampler sampler(const Layout& layout) const;
};

/// Loads the scene as the options ask for it; crop is applied to its film.
Scene load_scene(const CommonOptions& common, const RenderOptions* render);

}  // namespace warpath
