#include "render/preparation.h"

#include <algorithm>

#include "core/rng.h"
#include "core/streams.h"
#include "family/fit.h"
#include "family/warp_file.h"
#include "integrand/path_integrand.h"
#include "train/candidates.h"
#include "warpath/error.h"

namespace warpath {
namespace {

/// More candidates than this, 256 MB of them, are gathered and resampled in chunks of so many, where the family allows.
constexpr std::uint64_t kChunk = std::uint64_t{1} << 26;

std::shared_ptr<const Candidates> gather(const std::shared_ptr<const Tracer>& tracer, const Layout& layout,
                                         const TrainSettings& settings, std::uint64_t first, std::uint64_t end,
                                         const CandidateProgress& progress) {
  const std::uint64_t seed = mix64(settings.seed ^ kCandidateStream);
  const PathIntegrand integrand(tracer, layout, seed);
  return std::make_shared<Candidates>(
      gather_candidates(integrand, layout, seed, end - first, progress, settings.candidates_count, first));
}

/// Throws ConfigError if a warp to start from is none that could be of the method's kind.
void check_init(bool fits, const Method& method, const TrainSettings& settings) {
  if (!fits)
    throw ConfigError(fmt::format("--init {}: {} cannot start from it", settings.init.string(), method.family->name));
}

OnlineWarp online_warp(const Method& method, const TrainSettings& settings, const Tracer& tracer) {
  OnlineWarp warp;
  if (!settings.init.empty()) {
    warp.proposal = load_warp(settings.init).vertex_proposal;
    check_init(warp.proposal != nullptr, method, settings);
  }
  const FilmSettings& film = tracer.scene().film;
  const LearnedScene scene{film.width, film.height, tracer.emitters()};
  warp.learner = method.family->at_vertices()->make_learner(settings, scene, method.layout, warp.proposal.get());
  return warp;
}

}  // namespace

std::shared_ptr<const Candidates> Preparer::candidates(const Layout& layout, std::uint64_t count,
                                                       const TrainSettings& settings) {
  if (settings.seed != m_seed) m_candidates.clear();
  m_seed = settings.seed;
  auto& known = m_candidates[layout.name()];
  if (known && known->size() == count) return known;
  const Progress progress = m_stages(fmt::format("candidates for {}", layout.name()));
  known = gather(m_tracer, layout, settings, 0, count,
                 [&](std::uint64_t done) { progress(static_cast<double>(done) / static_cast<double>(count)); });
  return known;
}

Fit Preparer::fit_in_chunks(const Method& method, const TrainSettings& settings, const Proposal* init,
                            Preparation& preparation) {
  const std::uint64_t count = preparation.candidate_count;
  Progress progress = m_stages(fmt::format("candidates for {}", method.layout.name()));
  return warpath::fit_in_chunks(
      *method.family->joint(), method.layout, count,
      [&](const auto& take) {
        for (std::uint64_t first = 0; first < count; first += kChunk) {
          const auto chunk = gather(
              m_tracer, method.layout, settings, first, std::min(count, first + kChunk),
              [&](std::uint64_t done) { progress(static_cast<double>(first + done) / static_cast<double>(count)); });
          preparation.candidate_seconds += chunk->seconds;
          preparation.candidate_cpu_seconds += chunk->cpu_seconds;
          if (first == 0) preparation.candidates = chunk;
          take(*chunk);
        }
        progress = {};
        progress = m_stages("training");
      },
      settings, init);
}

void Preparer::fit(const Method& method, const TrainSettings& settings, Preparation& preparation) {
  const JointFamily& family = *method.family->joint();
  std::shared_ptr<const Proposal> init;
  if (!settings.init.empty()) {
    init = load_warp(settings.init).proposal;
    check_init(init != nullptr, method, settings);
  }
  if (family.learns()) preparation.candidate_count = candidate_count(settings);
  Fit fit;
  if (preparation.candidate_count > kChunk && fits_in_chunks(family) && !settings.candidates_count) {
    fit = fit_in_chunks(method, settings, init.get(), preparation);
  } else if (family.learns()) {
    preparation.candidates = candidates(method.layout, preparation.candidate_count, settings);
    preparation.candidate_seconds = preparation.candidates->seconds;
    preparation.candidate_cpu_seconds = preparation.candidates->cpu_seconds;
    const Progress progress = m_stages(fmt::format("training {}", method.name));
    fit = warpath::fit(family, *preparation.candidates, settings, init.get());
  } else {
    Candidates none;
    none.layout = method.layout;
    fit = warpath::fit(family, none, settings, init.get());
  }
  preparation.proposal = std::move(fit.proposal);
  preparation.log = std::move(fit.log);
}

Preparation Preparer::prepare(const Method& method, const TrainSettings& settings) {
  Preparation preparation;
  if (!method.family) return preparation;
  if (!method.file.empty()) {
    const WarpFile file = load_warp(method.file);
    preparation.proposal = file.proposal;
    preparation.warp.proposal = file.vertex_proposal;
  } else if (method.family->at_vertices()) {
    preparation.warp = online_warp(method, settings, *m_tracer);
  } else {
    fit(method, settings, preparation);
  }
  return preparation;
}

}  // namespace warpath
