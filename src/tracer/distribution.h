#pragma once
#include <span>
#include <vector>

#include "core/math.h"

namespace warpath {

/// Chooses an index with probability proportional to its weight.
class DiscreteDistribution {
 public:
  DiscreteDistribution() = default;
  /// Weights must not be negative; if all are 0, every index is as likely.
  explicit DiscreteDistribution(std::span<const float> weights);
  std::size_t size() const { return m_cdf.empty() ? 0 : m_cdf.size() - 1; }
  /// Sum of the weights.
  double total() const { return m_total; }
  float probability(std::size_t i) const { return m_cdf[i + 1] - m_cdf[i]; }
  /// The least u that picks the index.
  float begin(std::size_t i) const { return m_cdf[i]; }
  /// u in [0,1) picks the index; `rest` is where u falls within the index's share, again uniform in [0,1).
  std::size_t sample(float u, float& rest) const;

 private:
  std::vector<float> m_cdf;  // one entry more than indices, from 0 to 1
  double m_total = 0;
};

/// A density on the unit square that is bilinear between the nodes of a grid, sampled row first, then column, by
/// inverting piecewise quadratic distribution functions: a continuous map that keeps the order in both coordinates.
class BilinearDistribution {
 public:
  BilinearDistribution() = default;
  /// values: rows of `width` nodes from v = 0 to v = 1, not negative. width, height >= 2.
  BilinearDistribution(std::vector<float> values, int width, int height);
  Vec2 sample(const Vec2& u, float& pdf) const;
  float pdf(const Vec2& position) const;
  float average() const { return m_average; }  ///< integral of the values before they were normalised

 private:
  float value(int x, int y) const { return m_values[static_cast<std::size_t>(y) * m_width + x]; }

  int m_width = 0, m_height = 0;
  float m_average = 0;
  std::vector<float> m_values;       // normalised to an integral of 1
  std::vector<float> m_conditional;  // per row: integral from u = 0 to each node, in units of one cell
  std::vector<float> m_marginal;     // integral from v = 0 to each row, from 0 to 1
};

}  // namespace warpath
