#pragma once
#include <optional>
#include <string>

#include "render/pass_policy.h"

namespace warpath {

/// How `auto` chooses between uniform numbers and a warp of vertices that learns while it renders.
///
/// 1. The first passes are drawn uniformly, and the warp learns from them.
/// 2. The next one is drawn by the warp. Its efficiency is one over the error of a sample times its cost, relative to
///    that of the uniform pass before. A warp whose efficiency is hopeless is given up, else it goes on.
/// 3. Once it has learned more it is looked at again, and given up unless it pays by then.
/// 4. It stops learning when what passes teach lowers the error by less than learning costs.
///
/// What is given up is not tried again.
class Automatic final : public Fixed {
 public:
  /// warp: its name as a method. by_clock: costs are measured, else they are counted, so that choices repeat.
  Automatic(Schedule schedule, std::string warp, bool by_clock);

  std::optional<PassRecord> plan(int done) override;
  void judge(PassRecord& pass, const PassResult& result) override;
  std::string choice() const override { return m_choice; }

 private:
  enum class State { trying, keeps, gave_up };

  double efficiency(double error, double seconds_per_spp) const;
  void choose(PassRecord& pass, State state, double efficiency);
  void watch_learning(int done, double error);

  std::string m_warp;
  bool m_by_clock;
  State m_state = State::trying;
  bool m_looked_again = false, m_learns = true;
  double m_plain_error = 0, m_plain_seconds = 0;  // of one sample; for a sample per pixel
  double m_last_error = 0;                        // of the pass before, drawn by the warp
  int m_flat = 0;                                 // passes in a row that learning has gained next to nothing for
  std::string m_choice;
};

}  // namespace warpath
