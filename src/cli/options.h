#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "path/layout.h"
#include "render/method.h"
#include "train/training_options.h"

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

/// Options of commands that render.
struct RenderOptions {
  std::optional<int> spp;
  std::optional<double> time;
  std::filesystem::path replay;             ///< results.json whose runs under --time are repeated
  std::string crop;                         ///< X,Y,W,H
  std::string aov;                          ///< albedo,normal,depth
  std::string objective_name = "relmse";    ///< mse, relmse or even
  std::optional<std::string> sampler_name;  ///< independent, stratified or sobol

  std::optional<Objective> objective() const { return parse_objective(objective_name); }
  Sampler sampler(const Layout& layout) const { return parse_sampler(sampler_name.value_or("independent"), layout); }
};

/// Loads the scene as the options ask for it; crop is applied to its film.
Scene load_scene(const CommonOptions& common, const RenderOptions* render);

}  // namespace warpath
