#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "family/family.h"
#include "train/training_data.h"
#include "warp/grid.h"
#include "warp/proposal.h"

namespace warpath {

/// Learns, from iteration to iteration, what the next one is to be drawn with.
///
/// A first iteration of uniform points may hold a handful that matter. Then what is followed is not |f| but
/// q^(1 - b) |f|^b, between the density q that drew the points and |f|, with b such that enough of them matter; each
/// iteration goes on from the last one, and b grows to 1 (annealing [Neal01]).
///
/// `auto` refines a grid until that gains little, then puts a spline flow in front of it, unless the grid is good
/// enough; what measured best draws. `grid+spline` has the flow in any case.
class Learner {
 public:
  /// Throws ConfigError for a family that is unknown, or that cannot have so many dimensions.
  Learner(int dims, const std::string& family, std::uint64_t seed, std::size_t memory);

  /// Goes on from what an earlier one learned; it must be of the family's.
  void start_from(std::shared_ptr<const Proposal> proposal);

  /// Points of an iteration that proposal(share) drew. `variance`: of its mean, times the number of points, relative to
  /// the square of the mean. Throws Interrupted.
  void learn(Examples examples, double variance);

  /// Whether what draws next is a mixture, whose second component keeps weights bounded.
  bool defended() const;
  /// What draws next; `share`: of the second component, if there is one.
  std::shared_ptr<const Proposal> proposal(double share) const;
  std::string description() const;
  /// Examples that flows were trained on so far, each as often as it was used.
  std::uint64_t trained() const { return m_trained; }

 private:
  struct Pass {
    Examples examples;
    double effective_share;  ///< of its points: effective samples among them
  };
  void remember(Examples examples, double effective_share);
  bool grid_is_done(const Examples& examples, double effective_share) const;
  /// Of the iterations that were drawn about as well as the best one, row by row in turn, `most` rows at most.
  Examples pooled(std::size_t most) const;
  void learn_grid(const Examples& examples, bool tempered);
  void learn_warp(Examples examples, bool tempered);
  /// The same examples as the grid's latents.
  Examples behind_grid(Examples examples) const;

  /// Whether a flow may stand in front of the grid.
  bool has_front() const;

  int m_dims;
  std::string m_family;
  const JointFamily* m_adapts;  ///< what is fitted to points, behind the grid if there is one
  std::uint64_t m_seed;
  std::size_t m_memory;
  std::uint64_t m_trained = 0;
  int m_learned = 0;  ///< iterations, or 1 for all that a loaded proposal saw
  std::vector<Pass> m_passes;

  std::shared_ptr<const Grid> m_grid;  ///< null unless the family has one
  std::shared_ptr<const Warp> m_warp;  ///< spline flow, Real NVP or tree, in front of the grid if there is one
  bool m_grid_done = false;
  int m_flows = 0;                                  ///< how often a flow was trained
  double m_grid_variance = 0, m_warp_variance = 0;  ///< as measured; 0 if not yet
};

}  // namespace warpath
