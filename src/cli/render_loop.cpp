#include "cli/render_loop.h"

#include <algorithm>
#include <cmath>

#include "core/interrupt.h"

namespace warpath {

using Clock = std::chrono::steady_clock;

namespace {

double seconds_since(Clock::time_point then) { return std::chrono::duration<double>(Clock::now() - then).count(); }

/// One pass; what it teaches goes into the guide if another is to follow.
void add_pass(ImageEstimator& estimator, int spp, bool last, Guide& guide, const Progress& progress,
              const std::function<bool()>& stop) {
  if (guide.empty()) return estimator.add_pass(spp, progress, stop);
  const bool learns = guide.trainer && (guide.keep || !last);
  const std::uint64_t before = estimator.cost().samples;
  estimator.add_guided_pass(spp, {guide.warp.get(), learns ? guide.trainer.get() : nullptr, guide.objective}, progress,
                            stop);
  if (!learns || g_interrupted) return;
  const auto start = Clock::now();
  guide.warp = guide.trainer->fit();
  guide.taught += estimator.cost().samples - before;
  guide.fit_seconds += seconds_since(start);
}

}  // namespace

void render_passes(ImageEstimator& estimator, const Budget& budget, Guide& guide, const Progress& progress,
                   const std::function<void()>& checkpoint) {
  const auto left = [&] { return -seconds_since(*budget.deadline); };
  const double whole = budget.deadline ? std::max(1e-3, left()) : 1;
  double per_spp = 0;  // seconds, of the pass before
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
    const int before = done;
    const auto report = [&](double fraction) {
      if (!progress) return;
      progress(budget.deadline ? 1 - left() / whole : (before + fraction * next) / budget.spp);
    };
    const auto stop = [&] { return budget.deadline && before > 0 && Clock::now() > *budget.deadline; };
    const auto start = Clock::now();
    add_pass(estimator, next, last, guide, report, stop);
    per_spp = seconds_since(start) / next;
    done += next;
    checkpoint();
  }
}

}  // namespace warpath
