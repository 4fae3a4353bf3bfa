#include <CLI/CLI.hpp>
#include <memory>

#include "cli/commands.h"
#include "cli/method.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/render_loop.h"
#include "cli/terminal.h"
#include "core/log.h"
#include "warpath/error.h"

namespace warpath {
namespace {

struct RenderCommand {
  CommonOptions common;
  RenderOptions render;
  TrainingOptions training;
  std::string warp = "none";
  std::filesystem::path output = "out.exr";

  void run() {
    const Threads threads(common);
    check_image_name(output);
    const Method method = parse_method(warp);
    const std::vector<Aov> aovs = parse_aovs(render.aov);
    const auto tracer = std::make_shared<const Tracer>(load_scene(common, &render));
    const Budget budget = make_budget(render, tracer->scene().sample_count);
    const auto clock = start_clock();

    MethodTrainer trainer(tracer, training.train_settings(common.seed), training.init, training.use_samples(),
                          common.quiet);
    const PreparedMethod prepared = trainer.prepare(method);
    ImageEstimator estimator(*tracer, method.layout, prepared.proposal, common.seed);
    {
      prepared.add_candidates(estimator);
      StageProgress progress(fmt::format("rendering {}", method.name), common.quiet);
      render_passes(estimator, budget, progress.callback(), [] {});
    }
    if (estimator.cost().samples == 0) throw Interrupted{};

    ImageFile file = image_file(estimator.develop());
    describe(file, *tracer, method, common, estimator, clock());
    add_aovs(file, *tracer, aovs, common.seed);
    write_image(output, file);
    if (estimator.non_finite() > 0)
      log::warn("{} of {} samples were not finite; they count as 0", estimator.non_finite(), estimator.cost().samples);
    log::info("{}: {} samples, {:.1f} per pixel, {:.1f} s", output.string(), estimator.cost().samples, estimator.spp(),
              clock());
  }
};

}  // namespace

void add_render_command(CLI::App& app) {
  auto command = std::make_shared<RenderCommand>();
  CLI::App* sub = app.add_subcommand("render", "Render a scene");
  sub->add_option("scene", command->common.scene, "Mitsuba 3 scene file")->required();
  sub->add_option("-o,--output", command->output, "Image to write: .exr (with variance), .png, .jpg")
      ->capture_default_str();
  sub->add_option("--warp", command->warp,
                  "FAMILY[:DIMS] or a trained warp's file; families: none, uniform, grid, kdtree, realnvp")
      ->capture_default_str();
  command->render.add_to(*sub);
  sub->add_option("--aov", command->render.aov, "Further layers: albedo, normal, depth")->type_name("LIST");
  command->common.add_to(*sub);
  command->training.add_to(*sub);
  sub->callback([command] { command->run(); });
}

}  // namespace warpath
