#include "render/render_loop.h"

#include <algorithm>
#include <cmath>

#include "core/interrupt.h"
#include "core/stopwatch.h"

namespace warpath {

using Clock = std::chrono::steady_clock;

namespace {

/// Weight of a sample in the pass that begins at `done` samples per pixel, where passes learn: the first ones, drawn by
/// a warp that knows little, are noisier. It must not depend on what samples bring, so it is a curve that lies near the
/// reciprocals of the variances that were seen; the optimum is flat.
float weight_of_pass(int done) { return 0.25f + 0.75f * static_cast<float>(done) / (static_cast<float>(done) + 6); }

/// Draws a pass, and lets who learns from it do so.
class Passes {
 public:
  Passes(ImageEstimator& estimator, Guide& guide, bool by_clock) : m_estimator(estimator), m_guide(guide) {
    if (!guide.contenders.empty()) m_automatic.emplace(std::move(guide.contenders), by_clock);
  }
  Automatic* automatic() { return m_automatic ? &*m_automatic : nullptr; }
  bool online() const { return m_automatic || m_guide.trainer; }

  void add(const PassRecord& pass, float weight, const Progress& progress, const std::function<bool()>& stop) {
    if (!m_automatic && m_guide.empty()) return m_estimator.add_pass(pass.spp, progress, stop);
    const VertexWarp* warp = m_automatic ? m_automatic->warp(pass) : m_guide.warp.get();
    VertexLearner* learner = m_automatic ? m_automatic->learner(pass) : pass.teaches ? m_guide.trainer.get() : nullptr;
    const std::uint64_t before = m_estimator.cost().samples;
    m_estimator.add_guided_pass(pass.spp, {warp, learner, m_guide.objective, weight}, progress, stop);
    if (!learner || g_interrupted) return;
    const Stopwatch clock;
    if (m_automatic)
      m_automatic->fit(pass);
    else
      m_guide.warp = m_guide.trainer->warp();
    m_guide.taught += m_estimator.cost().samples - before;
    m_guide.fit_seconds += clock.wall();
    m_guide.fit_cpu_seconds += clock.cpu();
  }

 private:
  ImageEstimator& m_estimator;
  Guide& m_guide;
  std::optional<Automatic> m_automatic;
};

}  // namespace

std::vector<PassRecord> render_passes(ImageEstimator& estimator, const Budget& budget, Guide& guide,
                                      const Progress& progress, const std::function<void()>& checkpoint) {
  const bool replays = !budget.replay.empty();
  const auto left = [&] { return std::chrono::duration<double>(*budget.deadline - Clock::now()).count(); };
  const double whole = budget.deadline ? std::max(1e-3, left()) : 1;
  int planned = replays ? 0 : budget.spp;
  for (const PassRecord& pass : budget.replay) planned += pass.spp;
  double per_spp = 0;  // seconds, of the pass before
  Passes drawn(estimator, guide, budget.by_clock());
  Automatic* const automatic = drawn.automatic();
  if (automatic && replays) automatic->start_replay(budget.replay);
  const bool online = drawn.online();
  std::vector<PassRecord> passes;
  int done = 0;
  // Decides on the next pass; false if no more fits into the budget.
  const auto plan = [&](PassRecord& pass) {
    pass.spp = std::max(1, done);
    pass.teaches = true;
    const int fits = !budget.deadline ? budget.spp - done
                     : done > 0       ? static_cast<int>(std::min(left() / per_spp, 1e8))
                                      : 1;
    if (fits < 1) return false;
    // What is left is not enough for another pass that doubles all: then it is one with this.
    if (budget.deadline && done > 0 && 2 * pass.spp > fits) pass.spp = fits;
    pass.spp = std::min(pass.spp, fits);
    if (automatic) automatic->plan(pass, done);
    const bool last = pass.spp == fits && !(budget.deadline && done == 0);
    pass.teaches = pass.teaches && (guide.keep || !last);
    return true;
  };
  while (!g_interrupted) {
    PassRecord pass;
    if (replays) {
      if (passes.size() == budget.replay.size()) break;
      pass = budget.replay[passes.size()];
    } else if (!plan(pass)) {
      break;
    }
    const auto report = [&](double fraction) {
      if (progress) progress(budget.deadline ? 1 - left() / whole : (done + fraction * pass.spp) / planned);
    };
    // Asked once before each batch.
    std::uint64_t begun = 0;
    const auto stop = [&] {
      const bool ends = replays ? begun == pass.batches : budget.deadline && done > 0 && left() < 0;
      if (!ends) ++begun;
      return ends;
    };
    const Stopwatch clock;
    const std::uint64_t before = estimator.cost().samples;
    const double fitted_before = guide.fit_seconds;
    drawn.add(pass, online ? weight_of_pass(done) : 1, report, stop);
    per_spp = clock.wall() / pass.spp;
    if (!replays) pass.batches = begun;
    if (automatic && replays) automatic->replay(pass);
    if (automatic && !replays && !g_interrupted) {
      const double error = estimator.pass_moments().error(guide.objective, estimator.moments());
      const double paths = static_cast<double>(estimator.cost().samples - before) / pass.spp;
      // What is learned between passes is not a part of what a path costs.
      const double drawing = per_spp - (guide.fit_seconds - fitted_before) / pass.spp;
      const double spp_left = budget.deadline ? left() / drawing : budget.spp - done - pass.spp;
      automatic->judge(pass, {done, error, drawing, paths, spp_left});
    }
    passes.push_back(pass);
    done += pass.spp;
    checkpoint();
  }
  if (automatic) guide.choice = replays ? "as recorded" : automatic->choice();
  return passes;
}

}  // namespace warpath
