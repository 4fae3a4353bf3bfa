#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/scene.h"
#include "warpath/train.h"

namespace CLI {
class App;
}

namespace warpath {

/// Options that all commands share.
struct CommonOptions {
  std::filesystem::path scene;
  std::string size;                  ///< WxH
  std::vector<std::string> defines;  ///< name=value
  int max_depth = 0;
  std::uint64_t seed = 0;
  int threads = 0;  ///< 0: all
  bool verbose = false, quiet = false;

  void add_to(CLI::App& app);
  SceneOptions scene_options() const;  ///< throws ConfigError on a malformed --size or -D
};

/// Options of commands that train.
struct TrainingOptions {
  double epp = 16;
  std::uint64_t examples = 0;  ///< 0: epp x 200 x 160
  std::filesystem::path init;
  std::string training_samples = "discard";  ///< or use: candidates count in the image
  TrainSettings settings;

  void add_to(CLI::App& app);
  TrainSettings train_settings(std::uint64_t seed) const;
  bool use_samples() const { return training_samples == "use"; }

 private:
  std::string m_bn = "actnorm", m_masks = "binary", m_architecture = "default";
  std::string m_loss = "variance", m_networks = "shared";
  std::string m_kdtree_target = "rms", m_kdtree_split = "best";
};

/// Options of commands that render.
struct RenderOptions {
  std::optional<int> spp;
  std::optional<double> time;
  std::string crop;  ///< X,Y,W,H
  std::string aov;   ///< albedo,normal,depth

  void add_to(CLI::App& app);
};

/// Loads the scene as the options ask for it; crop is applied to its film.
Scene load_scene(const CommonOptions& common, const RenderOptions* render);

}  // namespace warpath
