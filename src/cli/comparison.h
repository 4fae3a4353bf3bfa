#pragma once
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "cli/commands.h"
#include "cli/output.h"
#include "cli/replay.h"
#include "render/method.h"
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
  void prepare_reference();
  /// Takes over the runs of an interrupted call of the same command, with their images.
  void take_finished_runs();
  bool has_run(const Method& method, int run) const;
  /// The passes that are to be replayed; none without --replay. Throws ConfigError.
  std::vector<PassRecord> replayed(const Method& method, std::uint64_t seed) const;
  MethodRun run_method(const Method& method, int run);
  void keep_densities(const Method& method, const PreparedMethod& prepared);

  std::shared_ptr<const Tracer> m_tracer;
  CompareCommand m_command;
  std::vector<Method> m_methods;
  std::optional<Replay> m_replay;  // read before results.json is written, which may be the same file
  Reference m_reference, m_reference_rest;
  std::map<int, std::unique_ptr<MethodTrainer>> m_trainers;  // by run
  ReportData m_data;
};

}  // namespace warpath
