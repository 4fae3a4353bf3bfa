#include "cli/comparison.h"

#include <fmt/chrono.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <tuple>

#include "cli/terminal.h"
#include "core/interrupt.h"
#include "core/log.h"
#include "core/rng.h"
#include "core/streams.h"
#include "report/densities.h"
#include "train/marginals.h"
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

/// Name of each column of y: `film.x`, `bounce1.dir.u`, `bounce1.lobe`.
std::vector<std::string> column_names(const Layout& layout) {
  std::vector<std::string> names;
  for (const Group group : layout.groups()) {
    const bool film = group.kind == GroupKind::film;
    if (group.size() == 1) {
      names.push_back(group.name());
    } else {
      names.push_back(group.name() + (film ? ".x" : ".u"));
      names.push_back(group.name() + (film ? ".y" : ".v"));
    }
  }
  return names;
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

/// MSE and relMSE that the image's own variance promises.
std::pair<double, double> predicted_errors(const ImageEstimate& image, const ImageRgb& reference) {
  double mse = 0, relmse = 0;
  for (std::size_t p = 0; p < image.mean.size(); ++p)
    for (int c = 0; c < 3; ++c) {
      mse += image.variance[p][c];
      relmse += image.variance[p][c] / (sqr(reference.pixels[p][c]) + 0.01);
    }
  const double count = 3 * static_cast<double>(image.mean.size());
  return {mse / count, relmse / count};
}

}  // namespace

ComparisonRunner::ComparisonRunner(std::shared_ptr<const Tracer> tracer, CompareCommand command,
                                   std::vector<Method> methods)
    : m_tracer(std::move(tracer)), m_command(std::move(command)), m_methods(std::move(methods)) {}

void ComparisonRunner::run(int threads) {
  const Scene& scene = m_tracer->scene();
  Comparison& c = m_data.comparison;
  c.scene = m_command.common.scene.string();
  c.version = WARPATH_VERSION;
  c.commit = WARPATH_COMMIT;
  c.cpu = cpu_name();
  c.date = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  c.command = m_command.typed;
  c.width = scene.film.crop_width;
  c.height = scene.film.crop_height;
  c.threads = threads;
  c.seed = m_command.common.seed;
  c.settings["sampler"] = m_command.render.sampler_name.value_or("independent");
  c.settings["max_depth"] = std::to_string(scene.integrator.max_depth);

  // What is wrong is said before any work.
  if (!m_command.render.replay.empty()) m_replay.emplace(m_command.render.replay);
  for (const Method& method : m_methods) {
    m_command.render.sampler(method.layout);
    for (int run = 0; run < m_command.runs; ++run) replayed(method, c.seed + static_cast<std::uint64_t>(run));
  }

  prepare_reference();
  m_data.reference = m_reference.image;
  c.reference = m_reference.path.string();
  c.reference_has_variance = m_reference.variance.has_value();

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
  const FilmSettings& film = m_tracer->scene().film;
  const std::uint64_t seed = mix64(m_command.common.seed ^ kReferenceStream);
  ImageEstimator estimator(*m_tracer, {}, nullptr, seed);
  if (m_command.reference.empty()) {
    const int spp = m_command.reference_spp > 0
                        ? m_command.reference_spp
                        : kReferenceFactor * m_command.render.spp.value_or(m_tracer->scene().sample_count);
    StageProgress progress(fmt::format("reference, {} spp", spp), m_command.common.quiet);
    estimator.add_pass(spp, progress.callback());
    if (g_interrupted) throw Interrupted{};
    const ImageEstimate image = estimator.develop();
    m_reference = as_reference(image);
    m_reference.path = m_command.directory / "reference.exr";
    m_reference_rest = as_reference(estimator.develop_rest());
    write_image(m_reference.path, image_file(image));
    return;
  }
  m_reference = read_reference(m_command.reference, film.crop_width, film.crop_height);
  // What is left of the given reference without what the camera sees emitted directly.
  constexpr int kEmissionSpp = 256;
  estimator.add_emission_pass(kEmissionSpp);
  const ImageEstimate emission = estimator.develop_emission();
  m_reference_rest = m_reference;
  for (std::size_t p = 0; p < emission.mean.size(); ++p) {
    m_reference_rest.image.pixels[p] -= emission.mean[p];
    if (m_reference_rest.variance) m_reference_rest.variance->pixels[p] += emission.variance[p];
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
  const RenderOptions& render = m_command.render;
  const auto is_whole = [&](const Method& method, const MethodRun& run) {
    if (m_replay) return run.passes.size() == replayed(method, run.seed).size();
    if (render.time) return run.total_seconds > 0.9 * *render.time;
    return run.spp > render.spp.value_or(m_tracer->scene().sample_count) - 0.5;
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

std::vector<PassRecord> ComparisonRunner::replayed(const Method& method, std::uint64_t seed) const {
  if (!m_replay) return {};
  return m_replay->passes(method.name, seed, size_name(m_tracer->scene().film));
}

MethodRun ComparisonRunner::run_method(const Method& method, int run) {
  const std::uint64_t seed = m_command.common.seed + static_cast<std::uint64_t>(run);
  const auto clock = start_clock();
  Budget budget = make_budget(m_command.render, m_tracer->scene().sample_count);
  budget.replay = replayed(method, seed);
  // Candidates are shared by the methods of a run: what they cost counts for each of them.
  auto& trainer = m_trainers[run];
  if (!trainer)
    trainer = std::make_unique<MethodTrainer>(m_tracer, m_command.training.train_settings(seed),
                                              m_command.training.init, m_command.training.use_samples(),
                                              m_command.render.objective(), terminal_stages(m_command.common.quiet));
  PreparedMethod prepared = trainer->prepare(method);
  const double prepare_seconds = prepared.candidate_seconds + prepared.log.seconds;
  const double prepare_cpu_seconds = prepared.candidate_cpu_seconds + prepared.log.cpu_seconds;

  MethodRun result;
  result.method = method.name;
  result.family = method.family;
  result.dims = method.layout.name();
  result.size = size_name(m_tracer->scene().film);
  result.seed = seed;
  result.candidate_seconds = prepared.candidate_seconds;
  result.train_seconds = prepared.log.seconds;
  result.training_stopped = prepared.log.stopped;
  for (const auto& p : prepared.log.points)
    result.training_curve.push_back({p.seconds, p.samples, p.loss, p.held_out, p.cpu_seconds});
  if (prepared.candidates) {
    const auto& target = prepared.candidates->target;
    result.candidates = result.train_samples = prepared.candidate_count;
    result.candidates_nonzero =
        static_cast<double>(std::count_if(target.begin(), target.end(), [](float g) { return g > 0; })) /
        static_cast<double>(target.size());
  }

  ImageEstimator estimator(*m_tracer, method.layout, prepared.proposal, seed, m_command.render.sampler(method.layout));
  {
    prepared.add_candidates(estimator);
    StageProgress progress(fmt::format("{}, run {} of {}", method.name, run + 1, m_command.runs),
                           m_command.common.quiet);
    auto passes = render_passes(estimator, budget, prepared.guide, progress.callback(), [&] {
      const ImageErrors errors = image_errors(image_rgb(estimator.develop()), m_reference);
      result.error_curve.push_back(
          {estimator.spp(), prepare_seconds + prepared.guide.fit_seconds + estimator.cost().total(), errors.mse,
           errors.relmse, prepare_cpu_seconds + prepared.guide.fit_cpu_seconds + estimator.cost().cpu_total()});
    });
    if (budget.by_clock()) result.passes = std::move(passes);
  }
  if (estimator.cost().samples == 0) throw Interrupted{};

  const RenderCost& cost = estimator.cost();
  result.spp = estimator.spp();
  result.samples = cost.samples;
  result.warp_seconds = cost.warp_seconds;
  result.trace_seconds = cost.trace_seconds + cost.emission_seconds;
  result.train_seconds += prepared.guide.fit_seconds;
  if (!prepared.guide.choice.empty()) result.training_stopped = prepared.guide.choice;
  result.train_samples += prepared.guide.taught;
  result.total_seconds = prepare_seconds + prepared.guide.fit_seconds + cost.total();
  result.candidate_cpu_seconds = prepared.candidate_cpu_seconds;
  result.train_cpu_seconds = prepared.log.cpu_seconds + prepared.guide.fit_cpu_seconds;
  result.warp_cpu_seconds = cost.warp_cpu_seconds;
  result.trace_cpu_seconds = cost.trace_cpu_seconds;
  result.total_cpu_seconds = prepare_cpu_seconds + prepared.guide.fit_cpu_seconds + cost.cpu_total();
  result.non_finite = estimator.non_finite();
  const ImageEstimate image = estimator.develop();
  const ImageRgb rest = image_rgb(estimator.develop_rest());
  result.set_errors(image_errors(image_rgb(image), m_reference));
  std::tie(result.mse_predicted, result.relmse_predicted) = predicted_errors(image, m_reference.image);
  const ImageErrors rest_errors = image_errors(rest, m_reference_rest);
  result.mse_rest = rest_errors.mse;
  result.relmse_rest = rest_errors.relmse;
  result.mean = image_mean(image_rgb(image));
  result.mean_rest = image_mean(rest);
  log::debug("{}: {:.1f} s in all", method.name, clock());

  if (run == 0) {
    m_data.images.push_back({method.name, image_rgb(image)});
    ImageFile file = image_file(image);
    describe(file, *m_tracer, method, m_command.common, estimator, result.total_seconds);
    write_image(m_command.directory / (file_name(method.name) + ".exr"), file);
    keep_densities(method, prepared);
  }
  return result;
}

void ComparisonRunner::keep_densities(const Method& method, const PreparedMethod& prepared) {
  if (!prepared.candidates || !prepared.proposal) return;
  constexpr int kBins = 64;
  constexpr std::uint64_t kSamples = 1 << 20;
  // Columns in pairs: both numbers of a group where it has two, else it and the first one of the next group, or, where
  // there is none, the x of the film and it.
  const std::vector<std::string> names = column_names(method.layout);
  const auto grid = [](Marginal marginal) { return DensityGrid{kBins, kBins, std::move(marginal.density)}; };
  for (const Group group : method.layout.groups()) {
    int x = method.layout.column(group), y = x + 1;
    if (y >= method.layout.dims()) std::tie(x, y) = std::pair(0, x);
    if (x == y) continue;
    m_data.densities.push_back({method.name, names[static_cast<std::size_t>(x)], names[static_cast<std::size_t>(y)], "",
                                grid(proposal_marginal(*prepared.proposal, x, y, kBins, kSamples)),
                                grid(target_marginal(*prepared.candidates, x, y, kBins))});
  }
  write_densities(m_command.directory / "densities.json", m_data.densities);
}

}  // namespace warpath
