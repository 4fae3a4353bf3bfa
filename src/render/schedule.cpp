#include "render/schedule.h"

#include <algorithm>

namespace warpath {

Schedule::Schedule(std::chrono::duration<double> time)
    : m_deadline(Clock::now() + std::chrono::duration_cast<Clock::duration>(time)),
      m_whole(std::max(1e-3, time.count())) {}

std::optional<Schedule::Length> Schedule::next(int done) const {
  int spp = std::max(1, done), fits = m_spp - done;
  if (m_deadline) {
    fits = done > 0 ? static_cast<int>(std::min(left() / m_seconds_per_spp, 1e8)) : 1;
    // What is left is not enough for another pass that doubles all: then it is one with this.
    if (done > 0 && 2 * spp > fits) spp = fits;
  }
  if (fits < 1) return {};
  spp = std::min(spp, fits);
  return Length{spp, spp == fits && !(m_deadline && done == 0)};
}

double Schedule::progress(double done) const { return m_deadline ? 1 - left() / m_whole : done / m_spp; }

}  // namespace warpath
