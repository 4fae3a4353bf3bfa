#include <memory>

#include "cli/commands.h"
#include "cli/comparison.h"
#include "cli/output.h"
#include "core/log.h"
#include "report/summary.h"
#include "scene/scene.h"

namespace warpath {

void run(const CompareCommand& command) {
  const Threads threads(command.process);
  std::vector<Method> methods;
  for (const std::string& text : command.methods) methods.push_back(parse_method(text));
  std::vector<std::string> families;
  for (const Method& method : methods) {
    check_sampler(command.render.sampler, method);
    families.push_back(method.trained_family());
  }
  command.training.check_used(families);
  const auto tracer = std::make_shared<const Tracer>(load_scene(command.scene));
  ComparisonRunner runner(tracer, command, std::move(methods));
  runner.run(threads.count());
  write_report(command.directory, runner.data());
  fmt::print("{}", results_table(runner.data().comparison));
  log::info("report: {}", (command.directory / "index.html").string());
}

}  // namespace warpath
