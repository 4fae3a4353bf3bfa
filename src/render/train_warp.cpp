#include "render/train_warp.h"

#include <algorithm>
#include <cmath>

#include "core/interrupt.h"
#include "core/option.h"
#include "core/stopwatch.h"
#include "warpath/error.h"

namespace warpath {
namespace {

TrainedWarp train_on_candidates(Renderer& renderer, const Method& method, const TrainSettings& training) {
  const Preparation prepared = renderer.prepare(method, training);
  TrainedWarp trained;
  trained.file.proposal = prepared.proposal;
  trained.file.settings = {{"examples", std::to_string(training.examples)},
                           {"alpha", fmt::format("{}", training.alpha)},
                           {"uniform_share", fmt::format("{}", training.uniform_share)},
                           {"candidate_seconds", fmt::format("{:.3f}", prepared.candidate_seconds)},
                           {"train_seconds", fmt::format("{:.3f}", prepared.log.seconds)},
                           {"stopped", prepared.log.stopped}};
  if (!prepared.log.points.empty())
    trained.file.settings["held_out"] = fmt::format("{:.6f}", prepared.log.points.back().held_out);
  trained.paths = prepared.candidate_count;
  trained.seconds = prepared.seconds();
  return trained;
}

TrainedWarp train_on_passes(Renderer& renderer, const Method& method, const TrainSettings& training) {
  const FilmSettings& film = renderer.tracer().scene().film;
  const double paths = training.alpha * static_cast<double>(training.examples);
  const double spp = std::ceil(paths / (double{1} * film.crop_width * film.crop_height));
  RenderSettings settings;
  settings.seed = training.seed;
  settings.spp = static_cast<int>(std::clamp(spp, 1.0, double{1 << 24}));
  settings.objective = {};
  settings.learns_from_last = true;
  const Stopwatch clock;
  Rendered rendered = renderer.render(method, settings, training, "training " + method.name);
  OnlineWarp& warp = rendered.preparation.warp;
  if (!warp.proposal || g_interrupted) throw Interrupted{};
  TrainedWarp trained;
  trained.file.vertex_proposal = std::move(warp.proposal);
  trained.paths = warp.taught;
  trained.seconds = clock.wall();
  trained.file.settings = {{"paths", std::to_string(trained.paths)},
                           {"train_seconds", fmt::format("{:.3f}", trained.seconds)}};
  return trained;
}

}  // namespace

void check_trainable(const Method& method) {
  if (method.family && method.family->learns() && method.file.empty() && !method.automatic) return;
  throw ConfigError(fmt::format("{}: there is nothing to train; FAMILY[:DIMS] has a family of {}", method.name,
                                alternatives(family_names([](const Family& f) { return f.learns(); }))));
}

TrainedWarp train_warp(Renderer& renderer, const Method& method, const TrainSettings& training) {
  check_trainable(method);
  TrainedWarp trained = method.family->at_vertices() ? train_on_passes(renderer, method, training)
                                                     : train_on_candidates(renderer, method, training);
  trained.file.layout = method.layout;
  trained.file.scene = renderer.tracer().scene().file.filename().string();
  trained.file.settings["method"] = method.name;
  trained.file.settings["seed"] = std::to_string(training.seed);
  return trained;
}

}  // namespace warpath
