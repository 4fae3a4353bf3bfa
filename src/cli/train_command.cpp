#include <memory>

#include "cli/commands.h"
#include "cli/output.h"
#include "cli/terminal.h"
#include "core/log.h"
#include "render/train_warp.h"

namespace warpath {

void run(const TrainCommand& command) {
  const Threads threads(command.process);
  const Method method = parse_method(command.warp);
  check_trainable(method);
  command.training.check_used({method.trained_family()}, true);
  Renderer renderer(std::make_shared<const Tracer>(load_scene(command.scene)), terminal_stages(command.process.quiet));
  const TrainedWarp trained = train_warp(renderer, method, command.training.settings(command.seed));
  save_warp(command.output, trained.file);
  log::info("{}: {} from {} paths, {:.1f} s", command.output.string(), method.name, trained.paths, trained.seconds);
}

}  // namespace warpath
