#include "cli/render_loop.h"

#include <algorithm>
#include <cmath>

#include "core/interrupt.h"

namespace warpath {

using Clock = std::chrono::steady_clock;

void render_passes(ImageEstimator& estimator, const Budget& budget, const Progress& progress,
                   const std::function<void()>& checkpoint) {
  const auto start = Clock::now();
  const auto until = [&](Clock::time_point then) { return std::chrono::duration<double>(then - Clock::now()).count(); };
  const double whole = budget.deadline ? std::max(1e-3, until(*budget.deadline)) : 1;
  int done = 0;
  while (!g_interrupted) {
    int next = std::max(1, done);
    if (budget.deadline) {
      const double left = until(*budget.deadline);
      if (done > 0) {
        // The first passes are slow (cold caches), so a little is left over: it goes into the pass after the next.
        const double per_spp = std::chrono::duration<double>(Clock::now() - start).count() / done;
        const int fits = static_cast<int>(std::min(left / per_spp, 1e8));
        if (fits < 1) break;
        next = 2 * next > fits ? fits : next;
      }
    } else {
      next = std::min(next, budget.spp - done);
      if (next == 0) break;
    }
    const int before = done;
    const auto report = [&](double fraction) {
      if (!progress) return;
      progress(budget.deadline ? 1 - until(*budget.deadline) / whole : (before + fraction * next) / budget.spp);
    };
    const auto stop = [&] { return budget.deadline && before > 0 && Clock::now() > *budget.deadline; };
    estimator.add_pass(next, report, stop);
    done += next;
    checkpoint();
  }
}

}  // namespace warpath
