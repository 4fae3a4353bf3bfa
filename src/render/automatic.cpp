#include "render/automatic.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/log.h"
#include "core/stopwatch.h"
#include "train/several_trainers.h"

namespace warpath {
namespace {

constexpr auto kPlain = "none";  // what is chosen if nothing pays

/// The pass before which `auto` has seen enough of uniform numbers: 8 samples per pixel.
constexpr int kTrialSpp = 8;
/// The pass that begins here is drawn uniformly and teaches nothing where costs are measured: that is what a path costs
/// without a warp.
constexpr int kPlainCostSpp = 2;
/// Samples per pixel by which contenders other than the first are judged.
constexpr int kOthersSpp = 4;
/// They are tried if as many as this are to be rendered, and if learning costs them less than such a share of it.
constexpr double kOthersMinSpp = 500, kOthersMostFitting = 0.02;
/// And must pay at once, and be so much better than the first, which has more to learn.
constexpr double kOthersBetter = 1.5;
/// After its first pass, where it knows little yet, a warp is given up only if its error times cost is so much worse;
/// where light is rare, deviations of few samples come out too small besides.
constexpr double kStillLearns = 0.2;
/// The pass before the second look, and how good the warp must be then: the plain pass that it is compared with was
/// shorter, and looks better than it was.
constexpr int kSecondLookSpp = 32;
constexpr double kLearned = 0.5;
/// From here on passes are watched for what learning still gains. As each is as long as all before it, learning from
/// one pays if it lowers the error of the next by half of what it costs, a share of a path: twice in a row less, and it
/// ends.
constexpr int kWatchedSpp = 64;
constexpr double kTeachingShare = 0.08;

/// The one of that name; null if there is none.
template <class Contenders>
auto* find(Contenders& contenders, const std::string& name) {
  const auto at = std::find_if(contenders.begin(), contenders.end(), [&](auto& c) { return c.name == name; });
  return at == contenders.end() ? nullptr : &*at;
}

}  // namespace

Automatic::Automatic(std::vector<Contender> contenders, bool by_clock)
    : m_contenders(std::move(contenders)), m_by_clock(by_clock) {}

const Contender* Automatic::next_to_try() const {
  const auto at = std::find_if(m_contenders.begin(), m_contenders.end(), [](auto& c) { return !c.tried; });
  return at == m_contenders.end() ? nullptr : &*at;
}

void Automatic::plan(PassRecord& pass, int done) const {
  if (m_contenders.empty()) return void(pass.teaches = false);
  if (m_chosen) {
    pass.drawn_by = m_contenders.front().name;
    pass.teaches = pass.teaches && m_learns;
  } else if (done < kTrialSpp) {
    pass.teaches = pass.teaches && (!m_by_clock || done != kPlainCostSpp);
  } else {
    const Contender* contender = next_to_try();
    pass.drawn_by = contender->name;
    if (contender != &m_contenders.front()) pass.spp = std::min(pass.spp, kOthersSpp);
  }
}

const VertexWarp* Automatic::warp(const PassRecord& pass) const {
  const Contender* contender = find(m_contenders, pass.drawn_by);
  return contender ? contender->warp.get() : nullptr;
}

VertexLearner* Automatic::learner(const PassRecord& pass) {
  if (!pass.teaches) return nullptr;
  if (Contender* contender = find(m_contenders, pass.drawn_by)) return contender->trainer.get();
  std::vector<VertexTrainer*> all;
  for (const Contender& contender : m_contenders) all.push_back(contender.trainer.get());
  if (all.size() < 2) return all.empty() ? nullptr : all.front();
  m_all = std::make_unique<SeveralTrainers>(std::move(all));
  return m_all.get();
}

void Automatic::fit(const PassRecord& pass) {
  for (Contender& contender : m_contenders) {
    if (!pass.drawn_by.empty() && contender.name != pass.drawn_by) continue;
    const Stopwatch clock;
    contender.warp = contender.trainer->warp();
    contender.fit_seconds = clock.wall();
  }
}

double Automatic::gain(const Contender& contender) const {
  const double cost = m_by_clock ? contender.seconds / m_plain_seconds : contender.path_cost;
  return m_plain_error / (contender.error * cost);
}

void Automatic::drop_costly(const Measured& measured) {
  const double passes = 4;  // that teach before the trial
  const auto too_costly = [&](const Contender& contender) {
    if (&contender == &m_contenders.front()) return false;
    const double fit_in_spp =
        m_by_clock ? contender.fit_seconds / measured.seconds_per_spp : contender.fit_cost / measured.paths_per_spp;
    return measured.spp_left < kOthersMinSpp || passes * fit_in_spp > kOthersMostFitting * measured.spp_left;
  };
  std::erase_if(m_contenders, too_costly);
}

void Automatic::choose(PassRecord& pass, const Contender* chosen) {
  pass.chosen = chosen ? chosen->name : kPlain;
  m_choice = fmt::format("{}; efficiency, 1 / (error x cost), over that of uniform numbers:", pass.chosen);
  for (const Contender& contender : m_contenders)
    if (contender.tried) m_choice += fmt::format(" {} {:.2f}", contender.name, gain(contender));
  log::info("auto: {}", m_choice);
  replay(pass);
}

void Automatic::judge(PassRecord& pass, const Measured& measured) {
  if (m_contenders.empty()) return;
  if (pass.drawn_by.empty()) {
    m_plain_error = measured.error;
    if (measured.done == 0) drop_costly(measured);
    if (measured.done == kPlainCostSpp || m_plain_seconds == 0) m_plain_seconds = measured.seconds_per_spp;
    return;
  }
  Contender& contender = *find(m_contenders, pass.drawn_by);
  contender.tried = true;
  contender.error = measured.error;
  contender.seconds = measured.seconds_per_spp;
  if (!m_chosen) {
    if (next_to_try()) return;
    const Contender* best = &m_contenders.front();
    for (const Contender& other : m_contenders)
      if (gain(other) > std::max(1.0, kOthersBetter * gain(*best))) best = &other;
    return choose(pass, gain(*best) < kStillLearns ? nullptr : best);
  }
  if (!m_settled && measured.done >= kSecondLookSpp) {
    m_settled = true;
    if (gain(contender) < kLearned) return choose(pass, nullptr);
  }
  watch_learning(measured);
}

void Automatic::watch_learning(const Measured& measured) {
  if (m_learns && measured.done >= kWatchedSpp && m_last_error > 0) {
    const bool flat = m_last_error / measured.error - 1 < kTeachingShare / 2;
    m_flat = flat ? m_flat + 1 : 0;
    if (m_flat == 2) {
      m_learns = false;
      m_choice += fmt::format("; learned from {} samples per pixel", measured.done);
      log::info("auto: learns no more after {} samples per pixel", measured.done);
    }
  }
  m_last_error = measured.error;
}

void Automatic::start_replay(const std::vector<PassRecord>& passes) {
  std::erase_if(m_contenders, [&](const Contender& contender) {
    return std::none_of(passes.begin(), passes.end(),
                        [&](const auto& pass) { return pass.drawn_by == contender.name; });
  });
}

void Automatic::replay(const PassRecord& pass) {
  if (pass.chosen.empty()) return;
  m_chosen = true;
  std::erase_if(m_contenders, [&](const Contender& contender) { return contender.name != pass.chosen; });
}

}  // namespace warpath
