#pragma once
#include <memory>
#include <string>
#include <vector>

#include "core/pass_record.h"
#include "train/vertex_trainer.h"

namespace warpath {

/// A warp at vertices that `auto` may choose, with what learns it.
struct Contender {
  std::string name;  ///< as a method
  std::unique_ptr<VertexTrainer> trainer;
  // By count of operations, in paths of uniform numbers:
  double path_cost;                          ///< of a path that it draws and learns from
  double fit_cost;                           ///< of what it does between two passes
  std::shared_ptr<const VertexWarp> warp{};  ///< what it has learned so far; null: nothing

  // What was measured of it.
  bool tried = false;
  double error = 0;        ///< of one sample that it draws
  double seconds = 0;      ///< for a sample per pixel
  double fit_seconds = 0;  ///< of the last one
};

/// How `auto` chooses between uniform numbers and contenders, which differ in family and in the numbers that they warp:
/// by the error of one sample times its cost, of a uniform pass and of one by each. All of them learn from the first
/// passes, which are uniform. The first contender is always tried, the others if the budget is large enough that their
/// trial costs little of it; then the best goes on alone. It is looked at again once it has learned more, and stops
/// learning when that no longer pays.
class Automatic {
 public:
  /// by_clock: costs are measured, else they are counted in operations, so that choices repeat.
  Automatic(std::vector<Contender> contenders, bool by_clock);

  /// Decides on the pass that begins at `done` samples per pixel, whose spp may be lowered.
  void plan(PassRecord& pass, int done) const;
  /// Who draws and who learns from a pass; null: nobody.
  const VertexWarp* warp(const PassRecord& pass) const;
  VertexLearner* learner(const PassRecord& pass);
  /// Those who learned from the pass take what it taught.
  void fit(const PassRecord& pass);

  /// What is known of a pass once it is done.
  struct Measured {
    int done;      ///< samples per pixel before it
    double error;  ///< of one sample, see PixelMoments::error
    double seconds_per_spp;
    double paths_per_spp;
    double spp_left;  ///< about as many are to follow, if they cost as much
  };
  /// Told of a pass that was planned here; notes in it what it chooses.
  void judge(PassRecord& pass, const Measured& measured);

  /// Repeats choices that were recorded: contenders that had no part in them are dropped.
  void start_replay(const std::vector<PassRecord>& passes);
  void replay(const PassRecord& pass);

  /// What goes on in the end, why it was chosen, and until when it learns.
  const std::string& choice() const { return m_choice; }

 private:
  const Contender* next_to_try() const;
  double gain(const Contender& contender) const;
  void drop_costly(const Measured& measured);
  void choose(PassRecord& pass, const Contender* contender);
  void watch_learning(const Measured& measured);

  std::vector<Contender> m_contenders;
  bool m_by_clock;
  bool m_chosen = false, m_settled = false, m_learns = true;
  double m_plain_error = 0, m_plain_seconds = 0;
  double m_last_error = 0;  // of the pass before, drawn by what was chosen
  int m_flat = 0;           // passes in a row that learning has gained next to nothing for
  std::string m_choice;
  std::unique_ptr<VertexLearner> m_all;  // the learner of the last pass that taught several
};

}  // namespace warpath
