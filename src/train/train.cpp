#include "train/train.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/rng.h"
#include "core/stopwatch.h"
#include "train/fit_grid.h"
#include "train/fit_kdtree.h"
#include "train/fit_realnvp.h"
#include "train/fit_spline.h"
#include "train/resample.h"
#include "warp/mixture.h"
#include "warp/scratch.h"
#include "warp/uniform.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::uint64_t kHeldOut = 64;             // one candidate of so many judges a kd-tree or a grid
constexpr std::size_t kMaxTreeBytes = 3ull << 30;  // rows that a kd-tree may be grown from, its working copy included

// Rows that a spline flow learns from, drawn from the candidates it has anyway: with fewer it soon knows them by heart.
constexpr std::uint64_t kSplineRows = std::uint64_t{1} << 22;
// Brighter candidates teach a spline flow no more than this, in units of E[g^2] / E[g], the mean over examples.
constexpr double kSplineMostTarget = 3;

/// The component that was learned: a mixture's first one that is not uniform.
const Proposal* learned(const Proposal* proposal) {
  if (const auto* mixture = dynamic_cast<const Mixture*>(proposal))
    for (const Mixture::Component& component : mixture->components())
      if (component.proposal->family() != "uniform") return component.proposal.get();
  return proposal;
}

/// Mean of -ln q over the density of g; 0 where there is no light.
double cross_entropy(const Proposal& proposal, const Examples& examples) {
  constexpr std::size_t kBatch = 1024;
  const std::size_t dims = examples.y.cols();
  const Scratch<double> y(kBatch * dims), log_q(kBatch);
  double sum = 0, weights = 0;
  for (std::size_t first = 0; first < examples.size(); first += kBatch) {
    const std::size_t rows = std::min(kBatch, examples.size() - first);
    std::copy_n(&examples.y(first, 0), rows * dims, y.data());
    proposal.log_density({y.data(), rows, dims}, {log_q.data(), rows});
    for (std::size_t i = 0; i < rows; ++i) {
      const double g = examples.weight[first + i];
      if (!(g > 0)) continue;
      sum -= g * log_q[i];
      weights += g;
    }
  }
  return weights > 0 ? sum / weights : 0;
}

/// Fits a kd-tree or a grid to all candidates but a few that are held out.
Fit fit_to_candidates(const Candidates& candidates, const TrainSettings& settings, const Proposal* init) {
  const Stopwatch clock;
  const std::uint64_t held_out = candidates.size() / kHeldOut;
  std::uint64_t count = candidates.size() - held_out;
  const std::uint64_t row_bytes = 2 * sizeof(float) * (static_cast<std::uint64_t>(candidates.layout.dims()) + 1);
  count = std::min(count, kMaxTreeBytes / row_bytes);
  Examples examples = weighted_examples(candidates, 0, count);
  Fit fit;
  if (settings.family == "grid") {
    const auto* grid = dynamic_cast<const Grid*>(init);
    if (init && !grid) throw ConfigError(fmt::format("a grid cannot start from a warp of family {}", init->family()));
    fit.proposal = fit_grid(examples, settings.grid, grid);
  } else {
    if (init) throw ConfigError("a kd-tree cannot start from a trained warp");
    fit.proposal = fit_kdtree(std::move(examples), settings.kdtree);
  }
  fit.log.seconds = clock.wall();
  fit.log.cpu_seconds = clock.cpu();
  fit.log.stopped = count == candidates.size() - held_out
                        ? "all candidates seen"
                        : fmt::format("{} candidates seen, as many as fit in memory", count);
  const Examples seen = weighted_examples(candidates, 0, std::min(count, held_out));
  const Examples unseen = weighted_examples(candidates, candidates.size() - held_out, held_out);
  fit.log.points.push_back({fit.log.seconds, count, cross_entropy(*fit.proposal, seen),
                            cross_entropy(*fit.proposal, unseen), fit.log.cpu_seconds});
  return fit;
}

constexpr auto kDark = "no candidate has any light";

/// Throws ConfigError for settings that make no sense.
void check(const TrainSettings& settings, const Layout& layout, const Proposal* init) {
  constexpr std::string_view kFamilies[] = {"uniform", "grid", "kdtree", "realnvp", "spline"};
  if (std::find(std::begin(kFamilies), std::end(kFamilies), settings.family) == std::end(kFamilies))
    throw ConfigError(
        fmt::format("unknown warp family \"{}\";{}", settings.family, suggestion(settings.family, kFamilies)));
  if (!(settings.uniform >= 0 && settings.uniform < 1))
    throw ConfigError(fmt::format("the share of uniform samples is {}, not in [0, 1)", settings.uniform));
  if (init && init->dims() != layout.dims())
    throw ConfigError(fmt::format("the warp to start from has {} dimensions, not {}", init->dims(), layout.dims()));
}

Fit untrained(const Layout& layout, std::string why) {
  return {std::make_shared<const Uniform>(layout.dims()), {.points = {}, .stopped = std::move(why)}};
}

/// What was learned, mixed with its share of uniform samples.
Fit with_uniform(Fit fit, const TrainSettings& settings) {
  if (settings.uniform > 0)
    fit.proposal = std::make_shared<Mixture>(
        std::vector<Mixture::Component>{{fit.proposal, 1 - settings.uniform},
                                        {std::make_shared<const Uniform>(fit.proposal->dims()), settings.uniform}});
  return fit;
}

}  // namespace

std::uint64_t candidate_count(const TrainSettings& settings) {
  if (!(settings.alpha > 0) || !(settings.alpha <= 1e6))
    throw ConfigError(fmt::format("alpha is {}, not above 0 and at most 1e6", settings.alpha));
  if (settings.examples < 1) throw ConfigError("training needs at least 1 example");
  const double count = std::ceil(settings.alpha * static_cast<double>(settings.examples));
  if (count > 1e12) throw ConfigError(fmt::format("{} candidates are too many", count));
  return static_cast<std::uint64_t>(count);
}

Fit train(const Candidates& candidates, const TrainSettings& settings, const Proposal* init) {
  if (trains_in_chunks(settings.family))
    return train_in_chunks(
        candidates.layout, candidates.size(), [&](const auto& take) { take(candidates); }, settings, init);
  check(settings, candidates.layout, init);
  if (settings.family == "uniform") return untrained(candidates.layout, "nothing to learn");
  if (!(target_moments(candidates).mean > 0)) return untrained(candidates.layout, kDark);
  return with_uniform(fit_to_candidates(candidates, settings, learned(init)), settings);
}

bool trains_in_chunks(const std::string& family) { return family == "realnvp" || family == "spline"; }

Fit train_in_chunks(const Layout& layout, std::uint64_t count, const CandidateChunks& chunks,
                    const TrainSettings& settings, const Proposal* init) {
  check(settings, layout, init);
  WARPATH_CHECK(trains_in_chunks(settings.family));
  const bool spline = settings.family == "spline";
  const std::uint64_t rows = spline ? std::max(settings.examples, std::min(count, kSplineRows)) : settings.examples;
  Resampler resampler(layout, count, rows, mix64(settings.seed + 1));
  double seconds = 0, cpu_seconds = 0;
  std::optional<float> most;  // told by the first chunk with light
  chunks([&](const Candidates& chunk) {
    const Stopwatch clock;
    if (!most)
      if (const TargetMoments moments = target_moments(chunk); moments.mean > 0)
        most = static_cast<float>(spline ? kSplineMostTarget * moments.mean_square / moments.mean : HUGE_VAL);
    resampler.add(chunk, most.value_or(HUGE_VALF));
    seconds += clock.wall();
    cpu_seconds += clock.cpu();
  });
  const ResampledExamples examples = std::move(resampler).take();
  if (examples.size() == 0) return untrained(layout, kDark);

  const auto counting_on = [&](auto flow) {
    flow.uniform = settings.uniform;
    return flow;
  };
  Fit fit = spline ? fit_spline(examples, counting_on(settings.spline), settings.seed, learned(init))
                   : fit_realnvp(examples, counting_on(settings.realnvp), settings.seed, learned(init));
  fit.log.seconds += seconds;
  fit.log.cpu_seconds += cpu_seconds;
  return with_uniform(std::move(fit), settings);
}

}  // namespace warpath
