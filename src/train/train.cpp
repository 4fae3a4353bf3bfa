#include "train/train.h"

#include <algorithm>
#include <cmath>

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
  constexpr std::string_view kFamilies[] = {"uniform", "grid", "kdtree", "realnvp", "spline"};
  if (std::find(std::begin(kFamilies), std::end(kFamilies), settings.family) == std::end(kFamilies))
    throw ConfigError(
        fmt::format("unknown warp family \"{}\";{}", settings.family, suggestion(settings.family, kFamilies)));
  if (!(settings.uniform >= 0 && settings.uniform < 1))
    throw ConfigError(fmt::format("the share of uniform samples is {}, not in [0, 1)", settings.uniform));
  const int dims = candidates.layout.dims();
  if (init && init->dims() != dims)
    throw ConfigError(fmt::format("the warp to start from has {} dimensions, not {}", init->dims(), dims));
  const auto uniform = std::make_shared<const Uniform>(dims);
  if (settings.family == "uniform") return {uniform, {.points = {}, .seconds = 0, .stopped = "nothing to learn"}};
  const TargetMoments moments = target_moments(candidates);
  if (!(moments.mean > 0)) return {uniform, {.points = {}, .seconds = 0, .stopped = "no candidate has any light"}};

  init = learned(init);
  Fit fit;
  if (settings.family == "realnvp" || settings.family == "spline") {
    const Stopwatch clock;
    const bool spline = settings.family == "spline";
    const std::uint64_t rows =
        spline ? std::max(settings.examples, std::min<std::uint64_t>(candidates.size(), kSplineRows))
               : settings.examples;
    const double most = spline ? kSplineMostTarget * moments.mean_square / moments.mean : HUGE_VAL;
    const Examples examples = resample(candidates, rows, mix64(settings.seed + 1), static_cast<float>(most));
    const double seconds = clock.wall(), cpu_seconds = clock.cpu();
    const auto with_uniform = [&](auto flow) {
      flow.uniform = settings.uniform;
      return flow;
    };
    fit = spline ? fit_spline(examples, with_uniform(settings.spline), settings.seed, init)
                 : fit_realnvp(examples, with_uniform(settings.realnvp), settings.seed, init);
    fit.log.seconds += seconds;
    fit.log.cpu_seconds += cpu_seconds;
  } else {
    fit = fit_to_candidates(candidates, settings, init);
  }
  if (settings.uniform > 0)
    fit.proposal = std::make_shared<Mixture>(
        std::vector<Mixture::Component>{{fit.proposal, 1 - settings.uniform}, {uniform, settings.uniform}});
  return fit;
}

}  // namespace warpath
