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
  void judge(const ImageEstimator& estimator, int done, double seconds_per_spp, Guide& guide) {
    const double error = estimator.pass_moments().error(guide.objective, estimator.moments());
    if (is_plain(done)) {
      m_plain_error = error;
      if (done == kPlainCostSpp) m_plain_seconds = seconds_per_spp;
      m_teaching_seconds = std::max(0.0, seconds_per_spp - m_plain_seconds);
      return;
    }
    // Passes double, and the last one teaches nothing: half of all paths do.
    const double cost = m_by_clock ? (seconds_per_spp - m_teaching_seconds / 2) / m_plain_seconds : kVertexWarpCost;
    const double gain = m_plain_error / (error * cost);
    const bool settled = done >= kSecondLookSpp;
    if (!settled && done > kTrialSpp) return;
    const bool pays = !(gain < (settled ? kLearned : kStillLearns));
    guide.choice = fmt::format(
        "{}: a field at every vertex has {:.2f} x the efficiency, 1 / (error x cost), and its paths cost {:.2f} x as "
        "much",
        pays ? "field" : "plain path tracing", gain, cost);
    log::info("auto: {}", guide.choice);
    if (!pays) {
      guide.warp = nullptr;
      guide.trainer = nullptr;
    }
    if (settled || !pays) guide.automatic = false;
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

void render_passes(ImageEstimator& estimator, const Budget& budget, Guide& guide, const Progress& progress,
                   const std::function<void()>& checkpoint) {
  const auto left = [&] { return std::chrono::duration<double>(*budget.deadline - Clock::now()).count(); };
  const double whole = budget.deadline ? std::max(1e-3, left()) : 1;
  double per_spp = 0;  // seconds, of the pass before
  Trial trial(budget.deadline.has_value());
  const bool online = guide.trainer != nullptr;
  int done = 0;
  while (!g_interrupted) {
    int next = std::max(1, done);
    bool last;
    if (budget.deadline) {
      last = false;
      if (done > 0) {
        const int fits = static_cast<int>(std::min(left() / per_spp, 1e8));
        if (fits < 1) break;
        last = 2 * next > fits;
        if (last) next = fits;
      }
    } else {
      next = std::min(next, budget.spp - done);
      if (next == 0) break;
      last = done + next == budget.spp;
    }
    const auto report = [&](double fraction) {
      if (!progress) return;
      progress(budget.deadline ? 1 - left() / whole : (done + fraction * next) / budget.spp);
    };
    const auto stop = [&] { return budget.deadline && done > 0 && left() < 0; };
    const Stopwatch clock;
    const bool teaches = (guide.keep || !last) && (!guide.automatic || trial.teaches(done));
    add_pass(estimator, next, !guide.automatic || !Trial::is_plain(done), teaches, online ? weight_of_pass(done) : 1,
             guide, report, stop);
    per_spp = clock.wall() / next;
    if (guide.automatic && !g_interrupted) trial.judge(estimator, done, per_spp, guide);
    done += next;
    checkpoint();
  }
}

}  // namespace warpath
