#pragma once
#include <time.h>

#include <chrono>

namespace warpath {

/// Seconds since it was made: of the clock, and of processors, summed over all threads of the process. The latter do
/// not count what other programs make it wait for.
class Stopwatch {
 public:
  double wall() const { return std::chrono::duration<double>(Clock::now() - m_start).count(); }
  double cpu() const { return process_cpu() - m_cpu; }

 private:
  using Clock = std::chrono::steady_clock;
  static double process_cpu() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }
  Clock::time_point m_start = Clock::now();
  double m_cpu = process_cpu();
};

}  // namespace warpath
