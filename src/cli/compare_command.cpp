#include <CLI/CLI.hpp>
#include <memory>

#include "cli/commands.h"
#include "cli/comparison.h"
#include "cli/terminal.h"
#include "core/log.h"
#include "report/summary.h"
#include "warpath/error.h"

namespace warpath {
namespace {

struct CompareCommand {
  ComparisonRunner::Settings settings;
  std::vector<std::string> methods{"none", "kdtree:film+bounce1", "realnvp:film+bounce1"};

  void run() {
    const Threads threads(settings.common);
    for (const std::string& text : methods) settings.methods.push_back(parse_method(text));
    settings.scene_name = settings.common.scene.string();
    const auto tracer = std::make_shared<Tracer>(load_scene(settings.common, &settings.render));
    ComparisonRunner runner(tracer, settings);
    runner.run(threads.count());
    write_report(settings.directory, runner.data());
    fmt::print("{}", results_table(runner.data().comparison));
    log::info("report: {}", (settings.directory / "index.html").string());
  }
};

}  // namespace

void add_compare_command(CLI::App& app, const std::string& command_line) {
  auto command = std::make_shared<CompareCommand>();
  auto& settings = command->settings;
  CLI::App* sub = app.add_subcommand("compare", "Render a scene by several methods, and report what each gains");
  sub->add_option("scene", settings.common.scene, "Mitsuba 3 scene file")->required();
  sub->add_option("--methods", command->methods, "Each none, FAMILY[:DIMS] or a trained warp's file")
      ->delimiter(',')
      ->capture_default_str();
  sub->add_option("--report", settings.directory, "Folder for images, results.json and index.html")->required();
  sub->add_option("--runs", settings.runs, "Repetitions with seeds that follow each other")
      ->capture_default_str()
      ->check(CLI::Range(1, 10000));
  auto* given = sub->add_option("--reference", settings.reference,
                                "Image to measure against (ref.variance.exr beside it is its noise)")
                    ->check(CLI::ExistingFile);
  sub->add_option("--reference-spp", settings.reference_spp,
                  "Samples of the reference that is rendered where none is given (default: 8 x spp)")
      ->check(CLI::Range(1, 1 << 24))
      ->excludes(given);
  settings.render.add_to(*sub);
  settings.common.add_to(*sub);
  settings.training.add_to(*sub);
  settings.command = command_line;
  sub->callback([command] { command->run(); });
}

}  // namespace warpath
