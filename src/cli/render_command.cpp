#include <memory>

#include "cli/commands.h"
#include "cli/output.h"
#include "cli/replay.h"
#include "cli/terminal.h"
#include "core/log.h"
#include "render/method.h"
#include "render/render_loop.h"
#include "scene/scene.h"
#include "warpath/error.h"

namespace warpath {
void run(const RenderCommand& command) {
  const CommonOptions& common = command.common;
  const Threads threads(common);
  check_image_name(command.output);
  const Method method = parse_method(command.warp);
  const Sampler sampler = command.render.sampler(method.layout);
  const std::vector<Aov> aovs = parse_aovs(command.render.aov);
  const auto tracer = std::make_shared<const Tracer>(load_scene(common, &command.render));
  Budget budget = make_budget(command.render, tracer->scene().sample_count);
  if (!command.render.replay.empty())
    budget.replay = Replay(command.render.replay).passes(method.name, common.seed, size_name(tracer->scene().film));
  const auto clock = start_clock();

  const TrainingOptions& training = command.training;
  MethodTrainer trainer(tracer, training.train_settings(common.seed), training.init, training.use_samples(),
                        command.render.objective(), terminal_stages(common.quiet));
  PreparedMethod prepared = trainer.prepare(method);
  auto estimator = std::make_unique<ImageEstimator>(*tracer, method.layout, prepared.proposal, common.seed, sampler);
  {
    prepared.add_candidates(*estimator);
    StageProgress progress(fmt::format("rendering {}", method.name), common.quiet);
    render_passes(*estimator, budget, prepared.guide, progress.callback(), [] {});
  }
  const std::uint64_t samples = estimator->cost().samples, non_finite = estimator->non_finite();
  const double spp = estimator->spp();
  if (samples == 0) throw Interrupted{};

  ImageFile file;
  {
    ImageFile about;
    describe(about, *tracer, method, common, *estimator, clock());
    const ImageEstimate image = estimator->take();
    estimator.reset();  // sums of a large film take more memory than anything that follows
    file = image_file(image);
    file.attributes = std::move(about.attributes);
  }
  add_aovs(file, *tracer, aovs, common.seed);
  write_image(command.output, file);
  if (non_finite > 0) log::warn("{} of {} samples were not finite; they count as 0", non_finite, samples);
  log::info("{}: {} samples, {:.1f} per pixel, {:.1f} s", command.output.string(), samples, spp, clock());
}

}  // namespace warpath
