#include <memory>

#include "cli/commands.h"
#include "cli/method.h"
#include "cli/output.h"
#include "core/log.h"
#include "scene/scene.h"
#include "warpath/error.h"
#include "warpath/warp_file.h"

namespace warpath {
void run(const TrainCommand& command) {
  const CommonOptions& common = command.common;
  const Threads threads(common);
  const Method method = parse_method(command.warp);
  if (method.family == "none" || method.family == "uniform" || !method.file.empty())
    throw ConfigError(fmt::format(
        "--warp {}: there is nothing to train; use FAMILY[:DIMS] with grid, kdtree, realnvp or spline", command.warp));
  const auto tracer = std::make_shared<const Tracer>(load_scene(common, nullptr));
  const TrainSettings settings = command.training.train_settings(common.seed);
  MethodTrainer trainer(tracer, settings, command.training.init, false, std::nullopt, common.quiet);
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
  save_warp(command.output, file);
  log::info("{}: {} from {} candidates, {:.1f} s", command.output.string(), method.name, prepared.candidates->size(),
            prepared.candidate_seconds + prepared.log.seconds);
}

}  // namespace warpath
