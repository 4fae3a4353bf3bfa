#include "family/fit.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/rng.h"
#include "core/stopwatch.h"
#include "warp/mixture.h"
#include "warp/scratch.h"
#include "warp/uniform.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::uint64_t kHeldOut = 64;                   // one candidate of so many judges what is fitted to candidates
constexpr std::uint64_t kMostExampleBytes = 3ull << 30;  // rows that are fitted to at once, a working copy included

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

/// Fits to all candidates but a few that are held out.
Fit fit_to_candidates(const FitToCandidates& fit_family, const Candidates& candidates, const TrainSettings& settings,
                      const Proposal* init) {
  const Stopwatch clock;
  const std::uint64_t held_out = candidates.size() / kHeldOut;
  std::uint64_t count = candidates.size() - held_out;
  const std::uint64_t row_bytes = 2 * sizeof(float) * (static_cast<std::uint64_t>(candidates.layout.dims()) + 1);
  count = std::min(count, kMostExampleBytes / row_bytes);
  Fit fit;
  fit.proposal = fit_family(weighted_examples(candidates, 0, count), settings, init);
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
  if (!(settings.uniform_share >= 0 && settings.uniform_share < 1))
    throw ConfigError(fmt::format("the share of uniform samples is {}, not in [0, 1)", settings.uniform_share));
  if (init && init->dims() != layout.dims())
    throw ConfigError(fmt::format("the warp to start from has {} dimensions, not {}", init->dims(), layout.dims()));
}

Fit untrained(const Layout& layout, std::string why) {
  return {std::make_shared<const Uniform>(layout.dims()), {.points = {}, .stopped = std::move(why)}};
}

/// What was learned, mixed with its share of uniform samples.
Fit with_uniform(Fit fit, const TrainSettings& settings) {
  if (settings.uniform_share > 0)
    fit.proposal = std::make_shared<Mixture>(std::vector<Mixture::Component>{
        {fit.proposal, 1 - settings.uniform_share},
        {std::make_shared<const Uniform>(fit.proposal->dims()), settings.uniform_share}});
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

Fit fit(const JointFamily& family, const Candidates& candidates, const TrainSettings& settings, const Proposal* init) {
  if (fits_in_chunks(family))
    return fit_in_chunks(
        family, candidates.layout, candidates.size(), [&](const auto& take) { take(candidates); }, settings, init);
  check(settings, candidates.layout, init);
  if (!family.learns()) return untrained(candidates.layout, "nothing to learn");
  if (!(target_moments(candidates).mean > 0)) return untrained(candidates.layout, kDark);
  return with_uniform(fit_to_candidates(std::get<FitToCandidates>(family.fit), candidates, settings, learned(init)),
                      settings);
}

bool fits_in_chunks(const JointFamily& family) { return std::holds_alternative<FitToExamples>(family.fit); }

Fit fit_in_chunks(const JointFamily& family, const Layout& layout, std::uint64_t count, const CandidateChunks& chunks,
                  const TrainSettings& settings, const Proposal* init) {
  check(settings, layout, init);
  const auto& to_examples = std::get<FitToExamples>(family.fit);
  const std::uint64_t rows = to_examples.count ? to_examples.count(settings, count) : settings.examples;
  Resampler resampler(layout, count, rows, mix64(settings.seed + 1));
  double seconds = 0, cpu_seconds = 0;
  std::optional<float> most;  // told by the first chunk with light
  chunks([&](const Candidates& chunk) {
    const Stopwatch clock;
    if (!most)
      if (const TargetMoments moments = target_moments(chunk); moments.mean > 0)
        most = to_examples.most_target > 0
                   ? static_cast<float>(to_examples.most_target * moments.mean_square / moments.mean)
                   : HUGE_VALF;
    resampler.add(chunk, most.value_or(HUGE_VALF));
    seconds += clock.wall();
    cpu_seconds += clock.cpu();
  });
  const ResampledExamples examples = std::move(resampler).take();
  if (examples.size() == 0) return untrained(layout, kDark);
  Fit fit = to_examples.fit(examples, settings, learned(init));
  fit.log.seconds += seconds;
  fit.log.cpu_seconds += cpu_seconds;
  return with_uniform(std::move(fit), settings);
}

const JointFamily& joint_family(std::string_view name) {
  const Family* family = find_family(name);
  if (family && family->joint()) return *family->joint();
  const auto names = family_names([](const Family& f) { return f.joint(); });
  const std::vector<std::string_view> known(names.begin(), names.end());
  throw ConfigError(fmt::format("unknown warp family \"{}\";{}", name, suggestion(name, known)));
}

}  // namespace warpath
