#pragma once
#include <chrono>
#include <optional>

namespace warpath {

/// How long passes are: each doubles what is there, so that an image that ends early is even. They end after a number
/// of samples per pixel, or at a deadline.
class Schedule {
 public:
  explicit Schedule(int spp) : m_spp(spp) {}
  explicit Schedule(std::chrono::duration<double> time);

  struct Length {
    int spp;
    bool last;
  };
  /// Of the pass after `done` samples per pixel; none if no more fits.
  std::optional<Length> next(int done) const;
  /// Told what a sample per pixel took in the pass before, everything included.
  void took(double seconds_per_spp) { m_seconds_per_spp = seconds_per_spp; }
  /// Whether the deadline is over. The first pass is always rendered whole.
  bool over(int done) const { return m_deadline && done > 0 && left() < 0; }
  /// How much is done, 0 to 1.
  double progress(double done) const;
  bool by_clock() const { return m_deadline.has_value(); }

 private:
  using Clock = std::chrono::steady_clock;
  double left() const { return std::chrono::duration<double>(*m_deadline - Clock::now()).count(); }

  int m_spp = 0;
  std::optional<Clock::time_point> m_deadline;
  double m_whole = 0;            // seconds to the deadline at the start
  double m_seconds_per_spp = 0;  // of the pass before
};

}  // namespace warpath
