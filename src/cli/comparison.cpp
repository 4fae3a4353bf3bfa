#include "cli/comparison.h"

#include <fmt/chrono.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <tuple>

#include "cli/density_pictures.h"
#include "cli/method_run.h"
#include "cli/output.h"
#include "cli/terminal.h"
#include "core/interrupt.h"
#include "core/rng.h"
#include "core/streams.h"
#include "report/densities.h"
#include "warpath/error.h"

namespace warpath {
namespace {

/// A reference needs this many times the samples, so that its own noise, which is subtracted, stays small.
constexpr int kReferenceFactor = 8;

std::string cpu_name() {
  std::ifstream stream("/proc/cpuinfo");
  for (std::string line; std::getline(stream, line);)
    if (line.starts_with("model name")) return line.substr(std::min(line.find(':') + 2, line.size()));
  return "unknown";
}

/// A file name from what was typed as a method.
std::string file_name(std::string method) {
  for (char& c : method)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '+' && c != '.' && c != '-') c = '_';
  return method;
}

Reference as_reference(const ImageEstimate& estimate) {
  Reference reference;
  reference.image = image_rgb(estimate);
  reference.variance = ImageRgb(estimate.width, estimate.height);
  reference.variance->pixels = estimate.variance;
  return reference;
}

/// A command line without what changes nothing in a run: how many there are, and who does them.
std::string without_resources(const std::string& command) {
  std::istringstream words(command);
  std::string rest;
  for (std::string word; words >> word;) {
    if (word == "--resume" || word == "--quiet" || word == "--verbose") continue;
    if (word == "--runs" || word == "--threads")
      words >> word;
    else
      rest += word + " ";
  }
  return rest;
}

}  // namespace

ComparisonRunner::ComparisonRunner(std::shared_ptr<const Tracer> tracer, CompareCommand command,
                                   std::vector<Method> methods)
    : m_command(std::move(command)),
      m_renderer(std::move(tracer), terminal_stages(m_command.process.quiet)),
      m_methods(std::move(methods)) {}

void ComparisonRunner::describe_comparison(int threads) {
  Comparison& c = m_data.comparison;
  c.scene = m_command.scene.file.string();
  c.version = WARPATH_VERSION;
  c.commit = WARPATH_COMMIT;
  c.cpu = cpu_name();
  c.date = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  c.command = m_command.typed;
  c.width = film().crop_width;
  c.height = film().crop_height;
  c.threads = threads;
  c.seed = m_command.render.seed;
  c.settings["sampler"] = sampler_name(m_command.render.sampler);
  c.settings["max_depth"] = std::to_string(m_renderer.tracer().scene().integrator.max_depth);
}

void ComparisonRunner::run(int threads) {
  Comparison& c = m_data.comparison;
  describe_comparison(threads);
  // What is wrong is said before any work.
  if (!m_command.replay.empty()) m_replay.emplace(m_command.replay);
  for (const Method& method : m_methods)
    for (int run = 0; run < m_command.runs; ++run) settings_of(method, c.seed + static_cast<std::uint64_t>(run));

  prepare_reference();
  m_data.reference = m_references.image.image;
  c.reference = m_references.image.path.string();
  c.reference_has_variance = m_references.image.variance.has_value();

  if (m_command.resume) take_finished_runs();
  for (int run = 0; run < m_command.runs && !g_interrupted; ++run)
    for (const Method& method : m_methods) {
      if (g_interrupted) break;
      if (has_run(method, run)) continue;
      try {
        c.results.push_back(run_method(method, run));
      } catch (const Interrupted&) {
        break;
      }
      // In the order of the methods, all runs of one together.
      const auto place = [&](const MethodRun& r) {
        return std::find_if(m_methods.begin(), m_methods.end(), [&](const Method& m) { return m.name == r.method; });
      };
      std::stable_sort(c.results.begin(), c.results.end(),
                       [&](const MethodRun& a, const MethodRun& b) { return place(a) < place(b); });
      write_results(m_command.directory / "results.json", c);
    }
  if (c.results.empty()) throw Interrupted{};
}

void ComparisonRunner::prepare_reference() {
  // It must not share a random number with what it judges.
  const std::uint64_t seed = mix64(m_command.render.seed ^ kReferenceStream);
  ImageEstimator estimator(m_renderer.tracer(), {}, nullptr, seed);
  if (m_command.reference.empty()) {
    const int samples = m_command.render.spp.value_or(m_renderer.tracer().scene().sample_count);
    const int spp = m_command.reference_spp.value_or(kReferenceFactor * samples);
    StageProgress progress(fmt::format("reference, {} spp", spp), m_command.process.quiet);
    estimator.add_pass(spp, progress.callback());
    if (g_interrupted) throw Interrupted{};
    const ImageEstimate image = estimator.develop();
    m_references.image = as_reference(image);
    m_references.image.path = m_command.directory / "reference.exr";
    m_references.rest = as_reference(estimator.develop_rest());
    write_image(m_references.image.path, image_file(image));
    return;
  }
  m_references.image = read_reference(m_command.reference, film().crop_width, film().crop_height);
  // What is left of the given reference without what the camera sees emitted directly.
  constexpr int kEmissionSpp = 256;
  estimator.add_emission_pass(kEmissionSpp);
  const ImageEstimate emission = estimator.develop_emission();
  m_references.rest = m_references.image;
  for (std::size_t p = 0; p < emission.mean.size(); ++p) {
    m_references.rest.image.pixels[p] -= emission.mean[p];
    if (m_references.rest.variance) m_references.rest.variance->pixels[p] += emission.variance[p];
  }
}

void ComparisonRunner::take_finished_runs() {
  const auto file = m_command.directory / "results.json";
  if (!std::filesystem::exists(file)) return;
  Comparison& c = m_data.comparison;
  const Comparison before = read_results(file);
  if (without_resources(before.command) != without_resources(c.command))
    throw ConfigError(fmt::format("--resume: {} was left by another command: {}", file.string(), before.command));
  if (before.commit != c.commit) c.warnings.push_back(fmt::format("some runs are of commit {}", before.commit));
  const auto is_whole = [&](const Method& method, const MethodRun& run) {
    const RenderSettings settings = settings_of(method, run.seed);
    if (!settings.replay.empty()) return run.passes.size() == settings.replay.size();
    if (settings.time) return run.total_seconds > 0.9 * *settings.time;
    return run.spp > settings.spp.value_or(m_renderer.tracer().scene().sample_count) - 0.5;
  };
  for (const Method& method : m_methods) {
    const auto image = m_command.directory / (file_name(method.name) + ".exr");
    if (!std::filesystem::exists(image)) continue;
    for (const MethodRun& run : before.results)
      if (run.method == method.name && run.seed - c.seed < static_cast<std::uint64_t>(m_command.runs) &&
          is_whole(method, run))
        c.results.push_back(run);
    if (has_run(method, 0)) m_data.images.push_back({method.name, read_image(image).image});
  }
  for (DensityPicture& picture : read_densities(m_command.directory / "densities.json"))
    for (const Method& method : m_methods)
      if (picture.method == method.name && has_run(method, 0)) m_data.densities.push_back(std::move(picture));
}

bool ComparisonRunner::has_run(const Method& method, int run) const {
  const std::uint64_t seed = m_data.comparison.seed + static_cast<std::uint64_t>(run);
  const auto& results = m_data.comparison.results;
  return std::any_of(results.begin(), results.end(),
                     [&](const MethodRun& r) { return r.method == method.name && r.seed == seed; });
}

RenderSettings ComparisonRunner::settings_of(const Method& method, std::uint64_t seed) const {
  RenderSettings settings = m_command.render;
  settings.seed = seed;
  if (m_replay) settings.replay = m_replay->passes(method.name, seed, size_name(film()));
  return settings;
}

MethodRun ComparisonRunner::run_method(const Method& method, int run) {
  const std::uint64_t seed = m_command.render.seed + static_cast<std::uint64_t>(run);
  const RenderSettings settings = settings_of(method, seed);
  std::vector<ErrorPoint> curve;
  const Rendered rendered =
      m_renderer.render(method, settings, m_command.training.settings(seed),
                        fmt::format("{}, run {} of {}", method.name, run + 1, m_command.runs),
                        [&](const Rendered& so_far) { curve.push_back(error_point(so_far, m_references.image)); });
  MethodRun measured = measure(method, settings, rendered, m_references);
  measured.size = size_name(film());
  measured.error_curve = std::move(curve);
  if (run == 0) keep_first_run(method, rendered);
  return measured;
}

void ComparisonRunner::keep_first_run(const Method& method, const Rendered& rendered) {
  const ImageEstimate image = rendered.estimator->develop();
  m_data.images.push_back({method.name, image_rgb(image)});
  ImageFile file = image_file(image);
  describe(file, m_renderer.tracer(), method, m_command.render.seed, *rendered.estimator, rendered.seconds());
  write_image(m_command.directory / (file_name(method.name) + ".exr"), file);
  for (DensityPicture& picture : density_pictures(method, rendered.preparation))
    m_data.densities.push_back(std::move(picture));
  if (!m_data.densities.empty()) write_densities(m_command.directory / "densities.json", m_data.densities);
}

}  // namespace warpath
