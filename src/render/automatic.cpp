#include "render/automatic.h"

#include <fmt/format.h>

#include "core/log.h"

namespace warpath {
namespace {

// The constants of the rule, in its order, each with what was measured (160 x 90, three to five seeds, where no more is
// said). Passes are named by the samples per pixel before them.

/// 1. So many samples per pixel are uniform, half of which tell the error of a uniform sample. At 32 samples per pixel
/// they cost `auto` 10 to 50 % of what the field gains on twelve public scenes.
constexpr int kTrialSpp = 8;
/// 1. Where costs are measured, this pass teaches nothing: it shows what a path costs without a warp.
constexpr int kPlainCostSpp = 2;
/// 2. Cost of a path with the field where costs are counted: 1.87 times a plain one on the kitchen, 1.82 on the White
/// Room, with looking up, drawing, learning and longer paths.
constexpr double kCountedCost = 1.85;
/// 2. Less than this is hopeless. At the first look the field has 0.62 to 0.83 on `ajar`, where it gains tenfold in the
/// end, 0.71 to 0.75 on the White Room, where it gains twofold, and 0.17 to 0.42 on `coins`, where caustics defeat it.
constexpr double kHopeless = 0.2;
/// 3. The pass of the second look, and what pays then. The uniform pass that it is compared with was shorter, and looks
/// better than it was: a bound of 1 gave the field up where it gained eightfold.
constexpr int kSecondLookSpp = 32;
constexpr double kPays = 0.5;
/// 4. Passes from here on are watched. Learning costs this share of a path; as each pass is as long as all before it,
/// learning from one pays if it lowers the error of the next by half of that. Twice in a row less, and it ends.
constexpr int kWatchedSpp = 64;
constexpr double kTeachingShare = 0.08;
constexpr int kFlatPasses = 2;

}  // namespace

Automatic::Automatic(Schedule schedule, std::string warp, bool by_clock)
    : Fixed(std::move(schedule), warp), m_warp(std::move(warp)), m_by_clock(by_clock) {}

std::optional<PassRecord> Automatic::plan(int done) {
  auto pass = Fixed::plan(done);
  if (!pass) return {};
  if (m_state == State::gave_up) {
    pass->drawn_by = kNoWarp;
    pass->teaches = false;
  } else if (m_state == State::keeps) {
    pass->teaches = pass->teaches && m_learns;
  } else if (done < kTrialSpp) {
    pass->drawn_by = kNoWarp;
    pass->teaches = pass->teaches && (!m_by_clock || done != kPlainCostSpp);
  }
  return pass;
}

double Automatic::efficiency(double error, double seconds_per_spp) const {
  return m_plain_error / (error * (m_by_clock ? seconds_per_spp / m_plain_seconds : kCountedCost));
}

void Automatic::choose(PassRecord& pass, State state, double efficiency) {
  m_state = state;
  pass.chosen = state == State::keeps ? m_warp : kNoWarp;
  m_choice = fmt::format("{}; efficiency, 1 / (error x cost), over that of uniform numbers: {} {:.2f}", pass.chosen,
                         m_warp, efficiency);
  log::info("auto: {}", m_choice);
}

void Automatic::judge(PassRecord& pass, const PassResult& result) {
  Fixed::judge(pass, result);
  if (m_state == State::gave_up) return;
  const double error = result.error(), seconds_per_spp = (result.seconds - result.fit_seconds) / pass.spp;
  if (pass.drawn_by == kNoWarp) {
    m_plain_error = error;
    if (result.done == kPlainCostSpp || m_plain_seconds == 0) m_plain_seconds = seconds_per_spp;
    return;
  }
  const double gained = efficiency(error, seconds_per_spp);
  if (m_state == State::trying) return choose(pass, gained < kHopeless ? State::gave_up : State::keeps, gained);
  if (!m_looked_again && result.done >= kSecondLookSpp) {
    m_looked_again = true;
    if (gained < kPays) return choose(pass, State::gave_up, gained);
  }
  watch_learning(result.done, error);
}

void Automatic::watch_learning(int done, double error) {
  if (m_learns && done >= kWatchedSpp && m_last_error > 0) {
    m_flat = m_last_error / error - 1 < kTeachingShare / 2 ? m_flat + 1 : 0;
    if (m_flat == kFlatPasses) {
      m_learns = false;
      m_choice += fmt::format("; learned from {} samples per pixel", done);
      log::info("auto: learns no more after {} samples per pixel", done);
    }
  }
  m_last_error = error;
}

}  // namespace warpath
