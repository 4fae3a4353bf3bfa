#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "cli/commands.h"
#include "cli/method_run.h"
#include "cli/replay.h"
#include "render/renderer.h"
#include "report/html.h"

namespace warpath {

/// Renders a scene by several methods, measures them against one reference, and keeps what a report shows.
class ComparisonRunner {
 public:
  ComparisonRunner(std::shared_ptr<const Tracer> tracer, CompareCommand command, std::vector<Method> methods);
  /// Runs everything, run by run and method by method; results.json is written anew after each, so that the last
  /// complete one survives whatever happens. Ends early on Ctrl-C, with what there is.
  void run(int threads);

  const ReportData& data() const { return m_data; }

 private:
  const FilmSettings& film() const { return m_renderer.tracer().scene().film; }
  /// What the report says of the comparison as a whole.
  void describe_comparison(int threads);
  void prepare_reference();
  /// Takes over the runs of an interrupted call of the same command, with their images.
  void take_finished_runs();
  bool has_run(const Method& method, int run) const;
  /// Of the run-th run of a method. Throws ConfigError where there is nothing to replay.
  RenderSettings settings_of(const Method& method, std::uint64_t seed) const;
  MethodRun run_method(const Method& method, int run);
  /// Its image and densities, for the report.
  void keep_first_run(const Method& method, const Rendered& rendered);

  CompareCommand m_command;
  Renderer m_renderer;
  std::vector<Method> m_methods;
  std::optional<Replay> m_replay;  // read before results.json is written, which may be the same file
  References m_references;
  ReportData m_data;
};

}  // namespace warpath
