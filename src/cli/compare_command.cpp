#include <memory>

#include "cli/commands.h"
#include "cli/comparison.h"
#include "core/log.h"
#include "report/summary.h"
#include "scene/scene.h"

namespace warpath {

void run(const CompareCommand& command) {
  const Threads threads(command.common);
  std::vector<Method> methods;
  for (const std::string& text : command.methods) methods.push_back(parse_method(text));
  const auto tracer = std::make_shared<Tracer>(load_scene(command.common, &command.render));
  ComparisonRunner runner(tracer, command, std::move(methods));
  runner.run(threads.count());
  write_report(command.directory, runner.data());
  fmt::print("{}", results_table(runner.data().comparison));
  log::info("report: {}", (command.directory / "index.html").string());
}

}  // namespace warpath
