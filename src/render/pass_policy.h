#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "path/pass_record.h"
#include "render/schedule.h"

namespace warpath {

/// What is known of a pass once it is done.
struct PassResult {
  int done;                       ///< samples per pixel before it
  double seconds;                 ///< that it took, learning included
  double fit_seconds;             ///< of these, what was spent on learning once it was drawn
  std::function<double()> error;  ///< of one sample, see PixelMoments::error; only of passes over a stratified film
};

/// Plans the passes of a render, one at a time. The loop that renders them knows no other way.
class PassPolicy {
 public:
  virtual ~PassPolicy() = default;
  /// The pass after `done` samples per pixel; none if the render is over.
  virtual std::optional<PassRecord> plan(int done) = 0;
  /// Whether a pass ends before its next batch, of which `begun` were begun before.
  virtual bool ends(const PassRecord& pass, int done, std::uint64_t begun) const = 0;
  /// Told of each pass that was planned here and is done; may note in it what that decides.
  virtual void judge(PassRecord& /*pass*/, const PassResult& /*result*/) {}
  /// How much of the render is done, 0 to 1, when `fraction` of a pass is.
  virtual double progress(const PassRecord& pass, int done, double fraction) const = 0;
  /// What was chosen in the end, and why; empty where there was no choice.
  virtual std::string choice() const { return {}; }
};

/// Every pass is drawn by the same warp, which learns from all of them but the last, or from that as well.
class Fixed : public PassPolicy {
 public:
  Fixed(Schedule schedule, std::string drawn_by, bool learns_from_last = false)
      : m_schedule(std::move(schedule)), m_drawn_by(std::move(drawn_by)), m_learns_from_last(learns_from_last) {}

  std::optional<PassRecord> plan(int done) override;
  bool ends(const PassRecord& pass, int done, std::uint64_t begun) const override;
  void judge(PassRecord& pass, const PassResult& result) override;
  double progress(const PassRecord& pass, int done, double fraction) const override;

 private:
  Schedule m_schedule;
  std::string m_drawn_by;
  bool m_learns_from_last;
};

/// The passes of an earlier render, whatever the clock says.
class Replayed final : public PassPolicy {
 public:
  explicit Replayed(std::vector<PassRecord> passes);

  std::optional<PassRecord> plan(int done) override;
  bool ends(const PassRecord& pass, int done, std::uint64_t begun) const override;
  double progress(const PassRecord& pass, int done, double fraction) const override;
  std::string choice() const override { return "as recorded"; }

 private:
  std::vector<PassRecord> m_passes;
  std::size_t m_next = 0;
  int m_spp = 0;  // of all passes
};

}  // namespace warpath
