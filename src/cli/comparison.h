#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "cli/method.h"
#include "cli/options.h"
#include "cli/output.h"
#include "report/html.h"

namespace warpath {

/// Renders a scene by several methods, measures them against one reference, and keeps what a report shows.
class ComparisonRunner {
 public:
  struct Settings {
    CommonOptions common;
    RenderOptions render;
    TrainingOptions training;
    std::vector<Method> methods;
    int runs = 1;
    std::filesystem::path reference;  ///< empty: rendered here
    int reference_spp = 0;            ///< of the reference that is rendered here; 0: 8 x spp
    std::filesystem::path directory;  ///< where images and results.json go
    std::string command;              ///< as typed
    std::string scene_name;
  };
  ComparisonRunner(std::shared_ptr<const Tracer> tracer, Settings settings);
  /// Runs everything, run by run and method by method; results.json is written anew after each, so that the last
  /// complete one survives whatever happens. Ends early on Ctrl-C, with what there is.
  void run(int threads);

  const ReportData& data() const { return m_data; }

 private:
  void prepare_reference();
  MethodRun run_method(const Method& method, int run);
  void keep_densities(const Method& method, const PreparedMethod& prepared);

  std::shared_ptr<const Tracer> m_tracer;
  Settings m_settings;
  Reference m_reference, m_reference_rest;
  std::map<int, std::unique_ptr<MethodTrainer>> m_trainers;  // by run
  ReportData m_data;
};

}  // namespace warpath
