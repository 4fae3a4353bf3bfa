#include <memory>

#include "cli/commands.h"
#include "cli/output.h"
#include "cli/replay.h"
#include "cli/terminal.h"
#include "core/log.h"
#include "core/stopwatch.h"
#include "render/renderer.h"
#include "scene/scene.h"

namespace warpath {

void run(const RenderCommand& command) {
  const Threads threads(command.process);
  check_image_name(command.output);
  const Method method = parse_method(command.warp);
  check_sampler(command.render.sampler, method);
  command.training.check_used({method.trained_family()});
  const std::vector<Aov> aovs = parse_aovs(command.aov);
  Renderer renderer(std::make_shared<const Tracer>(load_scene(command.scene)), terminal_stages(command.process.quiet));
  RenderSettings settings = command.render;
  if (!command.replay.empty())
    settings.replay =
        Replay(command.replay).passes(method.name, settings.seed, size_name(renderer.tracer().scene().film));
  const Stopwatch clock;
  Rendered rendered =
      renderer.render(method, settings, command.training.settings(settings.seed), "rendering " + method.name);

  const auto& estimator = rendered.estimator;
  const std::uint64_t samples = estimator->cost().samples, non_finite = estimator->non_finite();
  const double spp = estimator->spp();
  ImageFile file;
  {
    ImageFile about;
    describe(about, renderer.tracer(), method, settings.seed, *estimator, clock.wall());
    const ImageEstimate image = estimator->take();
    rendered.estimator.reset();  // sums of a large film take more memory than anything that follows
    file = image_file(image);
    file.attributes = std::move(about.attributes);
  }
  add_aovs(file, renderer.tracer(), aovs, settings.seed);
  write_image(command.output, file);
  if (non_finite > 0) log::warn("{} of {} samples were not finite; they count as 0", non_finite, samples);
  log::info("{}: {} samples, {:.1f} per pixel, {:.1f} s", command.output.string(), samples, spp, clock.wall());
}

}  // namespace warpath
