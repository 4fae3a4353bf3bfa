#include <CLI/CLI.hpp>
#include <memory>

#include "cli/commands.h"
#include "cli/method.h"
#include "cli/options.h"
#include "cli/output.h"
#include "core/log.h"
#include "warpath/error.h"
#include "warpath/warp_file.h"

namespace warpath {
namespace {

struct TrainCommand {
  CommonOptions common;
  TrainingOptions training;
  std::string warp;
  std::filesystem::path output;

  void run() {
    const Threads threads(common);
    const Method method = parse_method(warp);
    if (method.family == "none" || method.family == "uniform" || !method.file.empty())
      throw ConfigError(
          fmt::format("--warp {}: there is nothing to train; use FAMILY[:DIMS] with grid, kdtree or realnvp", warp));
    const auto tracer = std::make_shared<const Tracer>(load_scene(common, nullptr));
    const TrainSettings settings = training.train_settings(common.seed);
    MethodTrainer trainer(tracer, settings, training.init, false, common.quiet);
    const PreparedMethod prepared = trainer.prepare(method);

    WarpFile file{prepared.proposal, method.layout, tracer->scene().file.filename().string(), {}};
    file.settings = {{"method", method.name},
                     {"examples", std::to_string(settings.examples)},
                     {"alpha", fmt::format("{}", settings.alpha)},
                     {"uniform", fmt::format("{}", settings.uniform)},
                     {"seed", std::to_string(settings.seed)},
                     {"candidate_seconds", fmt::format("{:.3f}", prepared.candidate_seconds)},
                     {"train_seconds", fmt::format("{:.3f}", prepared.log.seconds)},
                     {"stopped", prepared.log.stopped}};
    if (!prepared.log.points.empty())
      file.settings["held_out"] = fmt::format("{:.6f}", prepared.log.points.back().held_out);
    save_warp(output, file);
    log::info("{}: {} from {} candidates, {:.1f} s", output.string(), method.name, prepared.candidates->size(),
              prepared.candidate_seconds + prepared.log.seconds);
  }
};

}  // namespace

void add_train_command(CLI::App& app) {
  auto command = std::make_shared<TrainCommand>();
  CLI::App* sub = app.add_subcommand("train", "Train a warp and save it");
  sub->add_option("scene", command->common.scene, "Mitsuba 3 scene file")->required();
  sub->add_option("--warp", command->warp, "FAMILY[:DIMS]: grid, kdtree or realnvp")->required();
  sub->add_option("-o,--output", command->output, "File to write (safetensors)")->required();
  command->common.add_to(*sub);
  command->training.add_to(*sub);
  sub->callback([command] { command->run(); });
}

}  // namespace warpath
