#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/option.h"
#include "render/renderer.h"
#include "scene/scene.h"

namespace warpath {

/// What is asked of a scene file.
struct SceneRequest {
  std::filesystem::path file;
  std::vector<std::pair<std::string, std::string>> parameters;  ///< of the scene, by name
  std::optional<std::array<int, 2>> size;                       ///< of the film, in place of the file's
  std::optional<std::array<int, 4>> crop;                       ///< x, y, width, height of the part that is rendered
  int max_depth = 0;                                            ///< 0: the file's
};

// The options of a render, one row each.
std::vector<Option> scene_option_table(SceneRequest& request);
std::vector<Option> render_option_table(RenderSettings& settings);

/// Loads the scene as it is asked for. Throws ConfigError for a crop window that is not inside the film, and FileError.
Scene load_scene(const SceneRequest& request);

}  // namespace warpath
