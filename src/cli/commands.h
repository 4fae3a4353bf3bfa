#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "family/training_options.h"
#include "render/render_options.h"

namespace warpath {

/// Options of every command that change nothing in what it makes.
struct ProcessOptions {
  std::optional<int> threads;  ///< none: all
  bool verbose = false, quiet = false;
};

struct RenderCommand {
  ProcessOptions process;
  SceneRequest scene;
  RenderSettings render;
  TrainingOptions training{TrainingOptions::Spelling::command_line};
  std::string warp = kNoWarp;
  std::filesystem::path output = "out.exr";
  std::string aov;               ///< albedo,normal,depth
  std::filesystem::path replay;  ///< results.json whose runs are repeated
};

struct TrainCommand {
  ProcessOptions process;
  SceneRequest scene;
  std::uint64_t seed = 0;
  TrainingOptions training{TrainingOptions::Spelling::command_line};
  std::string warp;
  std::filesystem::path output;
};

struct CompareCommand {
  ProcessOptions process;
  SceneRequest scene;
  RenderSettings render;
  TrainingOptions training{TrainingOptions::Spelling::command_line};
  std::vector<std::string> methods{kNoWarp, "kdtree:film+bounce1", "realnvp:film+bounce1"};
  std::filesystem::path replay;
  int runs = 1;
  std::filesystem::path reference;   ///< empty: rendered here
  std::optional<int> reference_spp;  ///< of the reference that is rendered here; none: 8 x spp
  std::filesystem::path directory;   ///< where images, results.json and index.html go
  bool resume = false;               ///< runs that results.json there has already are kept
  std::string typed;                 ///< the whole command line
};

struct InspectCommand {
  ProcessOptions process;
  SceneRequest scene;  ///< its file may be a warp, too
};

using Command = std::variant<RenderCommand, TrainCommand, CompareCommand, InspectCommand>;

/// The command that was asked for; none where help or the version was, which this prints. Throws ConfigError on usage
/// that is not known.
std::optional<Command> parse_command_line(int argc, const char* const* argv);

// They throw what warpath/error.h names.
void run(const RenderCommand& command);
void run(const TrainCommand& command);
void run(const CompareCommand& command);
void run(const InspectCommand& command);

}  // namespace warpath
