#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "cli/options.h"

namespace warpath {

struct RenderCommand {
  CommonOptions common;
  RenderOptions render;
  TrainingOptions training;
  std::string warp = "none";
  std::filesystem::path output = "out.exr";
};

struct TrainCommand {
  CommonOptions common;
  TrainingOptions training;
  std::string warp;
  std::filesystem::path output;
};

struct CompareCommand {
  CommonOptions common;
  RenderOptions render;
  TrainingOptions training;
  std::vector<std::string> methods{"none", "kdtree:film+bounce1", "realnvp:film+bounce1"};
  int runs = 1;
  std::filesystem::path reference;  ///< empty: rendered here
  int reference_spp = 0;            ///< of the reference that is rendered here; 0: 8 x spp
  std::filesystem::path directory;  ///< where images, results.json and index.html go
  bool resume = false;              ///< runs that results.json there has already are kept
  std::string typed;                ///< the whole command line
};

struct InspectCommand {
  CommonOptions common;  ///< `scene` may be a warp file, too
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
