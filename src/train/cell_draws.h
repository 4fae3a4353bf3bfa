#pragma once
#include <array>

namespace warpath {

/// Shares of uniform numbers that a cell of a field chooses from.
inline constexpr std::array<float, 6> kUniformShares{0.05f, 0.15f, 0.3f, 0.45f, 0.65f, 0.9f};

/// Sums over the draws of one kind of numbers, light sampling or scattering, in a cell of a field.
struct CellDraws {
  double n = 0, sum = 0, square = 0;  ///< of f / q
  /// What the sum of the squares of f / q would be with each share of uniform numbers; recent draws count most.
  std::array<float, kUniformShares.size()> with_share{};
  float learned = 0;  ///< share of the learned density in the field of this pass; 0: there is none

  /// term: f / q with the q of the draw, inv_q its inverse.
  void add(float term, float inv_q);
  /// Draws of the passes to come are from a new density, of which the learned one has this share.
  void begin_pass(double learned_share);
  void halve();
  double mean() const { return n > 0 ? sum / n : 0; }
  /// How many equal samples would tell as much, (sum f / q)^2 / sum (f / q)^2: a few that outshine all others tell
  /// little.
  double effective() const { return square > 0 ? sum * sum / square : 0; }
};

/// What the cells of a kind say of shares of uniform numbers: CellDraws::with_share over its sum, averaged by the
/// effective samples of each.
class PooledShares {
 public:
  void add(const CellDraws& draws);
  /// For each share; 0 if no cell has drawn from a learned density yet.
  std::array<double, kUniformShares.size()> mean() const;

 private:
  std::array<double, kUniformShares.size()> m_sum{};
  double m_weight = 0;
};

/// The share of uniform numbers with which a cell's draws would have had the least second moment. `pooled` is what
/// cells like it say, and decides where a cell has seen little; `otherwise` is the share if these say nothing either.
double best_uniform_share(const CellDraws& draws, const std::array<double, kUniformShares.size()>& pooled,
                          double otherwise);

}  // namespace warpath
