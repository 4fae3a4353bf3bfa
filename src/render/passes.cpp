#include "render/passes.h"

#include "core/interrupt.h"
#include "core/stopwatch.h"

namespace warpath {
namespace {

/// Weight of a sample in the pass that begins at `done` samples per pixel, where passes learn: the first ones, drawn by
/// a warp that knows little, are noisier. It must not depend on what samples bring, so it is a curve that lies near the
/// reciprocals of the variances that were seen; the optimum is flat.
float weight_of_pass(int done) { return 0.25f + 0.75f * static_cast<float>(done) / (static_cast<float>(done) + 6); }

/// What the pass taught goes into the warp. Returns the seconds that this took.
double learn(OnlineWarp& warp, std::uint64_t paths) {
  const Stopwatch clock;
  warp.proposal = warp.learner->fit();
  warp.taught += paths;
  const double seconds = clock.wall();
  warp.fit_seconds += seconds;
  warp.fit_cpu_seconds += clock.cpu();
  return seconds;
}

}  // namespace

std::vector<PassRecord> render_passes(ImageEstimator& estimator, PassPolicy& policy, const PassSettings& settings,
                                      OnlineWarp& warp, const Progress& progress,
                                      const std::function<void()>& checkpoint) {
  std::vector<PassRecord> passes;
  const bool learns = warp.learner != nullptr;
  int done = 0;
  while (!g_interrupted) {
    auto planned = policy.plan(done);
    if (!planned) break;
    PassRecord& pass = *planned;
    const auto report = [&](double fraction) {
      if (progress) progress(policy.progress(pass, done, fraction));
    };
    std::uint64_t begun = 0;
    const auto stop = [&] {  // asked once before each batch
      const bool ends = policy.ends(pass, done, begun);
      if (!ends) ++begun;
      return ends;
    };
    const Stopwatch clock;
    const std::uint64_t before = estimator.cost().samples;
    const bool teaches = learns && pass.teaches;
    if (settings.guided) {
      const VertexProposal* drawing = pass.drawn_by == kNoWarp ? nullptr : warp.proposal.get();
      const float weight = learns ? weight_of_pass(done) : 1;
      estimator.add_guided_pass(pass.spp, {drawing, teaches ? warp.learner.get() : nullptr, settings.objective, weight},
                                report, stop);
    } else {
      estimator.add_pass(pass.spp, report, stop);
    }
    const double fit_seconds = teaches && !g_interrupted ? learn(warp, estimator.cost().samples - before) : 0;
    pass.batches = begun;
    if (!g_interrupted)
      policy.judge(pass, {done, clock.wall(), fit_seconds,
                          [&] { return estimator.pass_moments().error(settings.objective, estimator.moments()); }});
    passes.push_back(pass);
    done += pass.spp;
    checkpoint();
  }
  return passes;
}

}  // namespace warpath
