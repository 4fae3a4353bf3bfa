#include <cmath>
#include <memory>

#include "cli/commands.h"
#include "cli/output.h"
#include "cli/terminal.h"
#include "core/interrupt.h"
#include "core/log.h"
#include "render/method.h"
#include "scene/scene.h"
#include "warp/warp_file.h"
#include "warpath/error.h"

namespace warpath {
namespace {

void save(const TrainCommand& command, WarpFile file, const TrainSettings& settings) {
  file.settings["method"] = command.warp;
  file.settings["seed"] = std::to_string(settings.seed);
  save_warp(command.output, file);
}

/// Learns from passes that render as many paths as other families take candidates.
void train_on_passes(const TrainCommand& command, const Tracer& tracer, const TrainSettings& settings, Guide guide) {
  const FilmSettings& film = tracer.scene().film;
  const double paths = settings.alpha * static_cast<double>(settings.examples);
  Budget budget;
  budget.spp = std::max(1, static_cast<int>(std::ceil(paths / (double{1} * film.crop_width * film.crop_height))));
  guide.keep = true;
  const auto clock = start_clock();
  ImageEstimator estimator(tracer, {}, nullptr, settings.seed);
  {
    StageProgress progress("training " + command.warp, command.common.quiet);
    render_passes(estimator, budget, guide, progress.callback(), [] {});
  }
  if (!guide.warp || g_interrupted) throw Interrupted{};
  WarpFile file;
  file.vertex_proposal = guide.warp;
  file.layout = parse_method(command.warp).layout;
  file.scene = tracer.scene().file.filename().string();
  file.settings = {{"paths", std::to_string(guide.taught)}, {"train_seconds", fmt::format("{:.3f}", clock())}};
  save(command, std::move(file), settings);
  log::info("{}: {} from {} paths, {:.1f} s", command.output.string(), command.warp, guide.taught, clock());
}

}  // namespace

void run(const TrainCommand& command) {
  const CommonOptions& common = command.common;
  const Threads threads(common);
  const Method method = parse_method(command.warp);
  if (method.family == "none" || method.family == "uniform" || method.family == "auto" || !method.file.empty())
    throw ConfigError(
        fmt::format("--warp {}: there is nothing to train; use FAMILY[:DIMS] with grid, kdtree, realnvp, spline "
                    "or field",
                    command.warp));
  const auto tracer = std::make_shared<const Tracer>(load_scene(common, nullptr));
  const TrainSettings settings = command.training.train_settings(common.seed);
  MethodTrainer trainer(tracer, settings, command.training.init, false, std::nullopt, terminal_stages(common.quiet));
  PreparedMethod prepared = trainer.prepare(method);
  if (prepared.guide.trainer) return train_on_passes(command, *tracer, settings, std::move(prepared.guide));

  WarpFile file;
  file.proposal = prepared.proposal;
  file.layout = method.layout;
  file.scene = tracer->scene().file.filename().string();
  file.settings = {{"examples", std::to_string(settings.examples)},
                   {"alpha", fmt::format("{}", settings.alpha)},
                   {"uniform", fmt::format("{}", settings.uniform)},
                   {"candidate_seconds", fmt::format("{:.3f}", prepared.candidate_seconds)},
                   {"train_seconds", fmt::format("{:.3f}", prepared.log.seconds)},
                   {"stopped", prepared.log.stopped}};
  if (!prepared.log.points.empty())
    file.settings["held_out"] = fmt::format("{:.6f}", prepared.log.points.back().held_out);
  save(command, std::move(file), settings);
  log::info("{}: {} from {} candidates, {:.1f} s", command.output.string(), method.name, prepared.candidate_count,
            prepared.candidate_seconds + prepared.log.seconds);
}

}  // namespace warpath
