#include "render/render_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/interrupt.h"
#include "core/log.h"
#include "core/stopwatch.h"

namespace warpath {

using Clock = std::chrono::steady_clock;

namespace {

/// What a path costs with a warp at its vertices, over what one costs without, by count of operations: looking a vertex
/// up, two densities, what half of the paths teach, and longer paths with more light to look for, against two rays, a
/// BSDF and a light.
constexpr double kVertexWarpCost = 1.85;
/// The pass before which `auto` has seen enough of both ways: 8 samples per pixel of each.
constexpr int kTrialSpp = 8;
/// After its first pass, where it knows little yet, the warp is given up only if its error times cost is so much worse;
/// where light is rare, deviations of few samples come out too small besides.
constexpr double kStillLearns = 0.3;
/// The pass before the second look, and how good the warp must be then: the plain pass that it is compared with was
/// shorter, and looks better than it was.
constexpr int kSecondLookSpp = 32;
constexpr double kLearned = 0.5;
/// The pass that begins here is drawn uniformly and teaches nothing where costs are measured: that is what a path costs
/// without a warp.
constexpr int kPlainCostSpp = 2;

/// How `auto` chooses between uniform numbers and the warp at vertices: error of one sample times its cost, of the last
/// pass before kTrialSpp, drawn uniformly, and of the first one after it, drawn by the warp, and again of one at
/// kSecondLookSpp.
class Trial {
 public:
  /// by_clock: costs are measured, else they are counted in operations, so that choices repeat.
  explicit Trial(bool by_clock) : m_by_clock(by_clock) {}

  /// Whether the pass that begins at `done` samples per pixel is still drawn uniformly.
  static bool is_plain(int done) { return done < kTrialSpp; }
  /// Whether it teaches the warp.
  bool teaches(int done) const { return !m_by_clock || done != kPlainCostSpp; }
  /// Told of the pass that began at `done`; gives the warp up, and returns true, if it does not pay.
  bool judge(const ImageEstimator& estimator, int done, double seconds_per_spp, Guide& guide) {
    const double error = estimator.pass_moments().error(guide.objective, estimator.moments());
    if (is_plain(done)) {
      m_plain_error = error;
      if (done == kPlainCostSpp) m_plain_seconds = seconds_per_spp;
      m_teaching_seconds = std::max(0.0, seconds_per_spp - m_plain_seconds);
      return false;
    }
    // Passes double, and the last one teaches nothing: half of all paths do.
    const double cost = m_by_clock ? (seconds_per_spp - m_teaching_seconds / 2) / m_plain_seconds : kVertexWarpCost;
    const double gain = m_plain_error / (error * cost);
    const bool settled = done >= kSecondLookSpp;
    if (!settled && done > kTrialSpp) return false;
    const bool pays = !(gain < (settled ? kLearned : kStillLearns));
    const std::string choice = fmt::format(
        "{}: a field at every vertex has {:.2f} x the efficiency, 1 / (error x cost), and its paths cost {:.2f} x as "
        "much",
        pays ? "field" : "plain path tracing", gain, cost);
    log::info("auto: {}", choice);
    if (!pays)
      guide.give_up(choice);
    else
      guide.choice = choice;
    if (settled) guide.automatic = false;
    return !pays;
  }

 private:
  bool m_by_clock;
  double m_plain_error = 0, m_plain_seconds = 0, m_teaching_seconds = 0;
};

/// Weight of a sample in the pass that begins at `done` samples per pixel, where passes learn: the first ones, drawn by
/// a warp that knows little, are noisier. It must not depend on what samples bring, so it is a curve that lies near the
/// reciprocals of the variances that were seen; the optimum is flat.
float weight_of_pass(int done) { return 0.25f + 0.75f * static_cast<float>(done) / (static_cast<float>(done) + 6); }

/// One pass; what it teaches goes into the guide if another is to follow.
void add_pass(ImageEstimator& estimator, int spp, bool warped, bool teaches, float weight, Guide& guide,
              const Progress& progress, const std::function<bool()>& stop) {
  if (guide.empty()) return estimator.add_pass(spp, progress, stop);
  const bool learns = guide.trainer && teaches;
  const std::uint64_t before = estimator.cost().samples;
  estimator.add_guided_pass(
      spp, {warped ? guide.warp.get() : nullptr, learns ? guide.trainer.get() : nullptr, guide.objective, weight},
      progress, stop);
  if (!learns || g_interrupted) return;
  const Stopwatch clock;
  guide.warp = guide.trainer->warp();
  guide.taught += estimator.cost().samples - before;
  guide.fit_seconds += clock.wall();
  guide.fit_cpu_seconds += clock.cpu();
}

}  // namespace

std::vector<PassRecord> render_passes(ImageEstimator& estimator, const Budget& budget, Guide& guide,
                                      const Progress& progress, const std::function<void()>& checkpoint) {
  const bool replays = !budget.replay.empty();
  const auto left = [&] { return std::chrono::duration<double>(*budget.deadline - Clock::now()).count(); };
  const double whole = budget.deadline ? std::max(1e-3, left()) : 1;
  int planned = replays ? 0 : budget.spp;
  for (const PassRecord& pass : budget.replay) planned += pass.spp;
  double per_spp = 0;  // seconds, of the pass before
  Trial trial(budget.by_clock());
  const bool online = guide.trainer != nullptr;
  std::vector<PassRecord> passes;
  int done = 0;
  // Decides on the next pass; false if no more fits into the budget.
  const auto plan = [&](PassRecord& pass) {
    pass.spp = std::max(1, done);
    bool last;
    if (budget.deadline) {
      const int fits = done > 0 ? static_cast<int>(std::min(left() / per_spp, 1e8)) : 0;
      if (done > 0 && fits < 1) return false;
      last = done > 0 && 2 * pass.spp > fits;
      if (last) pass.spp = fits;
    } else {
      pass.spp = std::min(pass.spp, budget.spp - done);
      if (pass.spp == 0) return false;
      last = done + pass.spp == budget.spp;
    }
    pass.teaches = (guide.keep || !last) && (!guide.automatic || trial.teaches(done));
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
    add_pass(estimator, pass.spp, !guide.automatic || !Trial::is_plain(done), pass.teaches,
             online ? weight_of_pass(done) : 1, guide, report, stop);
    per_spp = clock.wall() / pass.spp;
    if (replays) {
      if (pass.gave_up) guide.give_up("plain path tracing, as recorded");
    } else {
      if (guide.automatic && !g_interrupted) pass.gave_up = trial.judge(estimator, done, per_spp, guide);
      pass.batches = begun;
    }
    passes.push_back(pass);
    done += pass.spp;
    checkpoint();
  }
  return passes;
}

}  // namespace warpath
