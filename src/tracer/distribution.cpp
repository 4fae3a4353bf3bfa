#include "tracer/distribution.h"

#include <algorithm>
#include <cmath>

namespace warpath {
namespace {

constexpr std::size_t kFew = 24;

// Inverts the distribution function of a density that runs linearly from a to b over [0,1]; `area` in [0, (a + b) / 2].
float sample_linear(float a, float b, float area) {
  // a t + (b - a) t^2 / 2 = area, in the form of the quadratic formula that does not cancel.
  const float root = std::sqrt(larger(0.0f, a * a + 2 * (b - a) * area));
  const float denominator = a + root;
  return denominator > 0 ? smaller(2 * area / denominator, 1.0f) : 0.0f;
}

}  // namespace

DiscreteDistribution::DiscreteDistribution(std::span<const float> weights) {
  if (weights.empty()) return;
  for (const float w : weights) m_total += w;
  m_cdf.resize(weights.size() + 1);
  double sum = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    sum += m_total > 0 ? weights[i] / m_total : 1.0 / static_cast<double>(weights.size());
    m_cdf[i + 1] = static_cast<float>(std::min(sum, 1.0));
  }
  // Rounding must not leave a gap below 1, nor give it to an index of weight 0 at the end.
  const float last = m_cdf.back();
  for (std::size_t i = m_cdf.size(); i-- > 0 && m_cdf[i] == last;) m_cdf[i] = 1;
}

std::size_t DiscreteDistribution::sample(float u, float& rest) const {
  if (size() <= kFew) {  // counting beats a search whose every step is a guess for the processor
    std::size_t i = 0;
    for (std::size_t k = 1; k < size(); ++k) i += u >= m_cdf[k];
    rest = smaller(kOneMinusEpsilon, (u - m_cdf[i]) / (m_cdf[i + 1] - m_cdf[i]));
    return i;
  }
  const auto above = std::upper_bound(m_cdf.begin() + 1, m_cdf.end() - 1, u);
  const std::size_t i = static_cast<std::size_t>(above - m_cdf.begin()) - 1;
  rest = smaller((u - m_cdf[i]) / (m_cdf[i + 1] - m_cdf[i]), kOneMinusEpsilon);
  return i;
}

BilinearDistribution::BilinearDistribution(std::vector<float> values, int width, int height)
    : m_width(width), m_height(height), m_values(std::move(values)) {
  const int cells_x = width - 1, cells_y = height - 1;
  std::vector<double> row_integrals(static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < cells_x; ++x) row_integrals[y] += 0.5 * (static_cast<double>(value(x, y)) + value(x + 1, y));
  double total = 0;
  for (int y = 0; y < cells_y; ++y) total += 0.5 * (row_integrals[y] + row_integrals[y + 1]);
  m_average = static_cast<float>(total / (static_cast<double>(cells_x) * cells_y));
  if (!(total > 0)) {
    std::fill(m_values.begin(), m_values.end(), 1.0f);
    std::fill(row_integrals.begin(), row_integrals.end(), cells_x);
    total = static_cast<double>(cells_x) * cells_y;
  }
  const double scale = static_cast<double>(cells_x) * cells_y / total;
  for (float& v : m_values) v = static_cast<float>(v * scale);

  m_conditional.resize(m_values.size());
  m_marginal.resize(static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    double sum = 0;
    for (int x = 1; x < width; ++x) {
      sum += 0.5 * (static_cast<double>(value(x - 1, y)) + value(x, y));
      m_conditional[static_cast<std::size_t>(y) * width + x] = static_cast<float>(sum);
    }
  }
  double sum = 0;
  for (int y = 1; y < height; ++y) {
    sum += 0.5 * (row_integrals[y - 1] + row_integrals[y]) / total;
    m_marginal[static_cast<std::size_t>(y)] = static_cast<float>(sum);
  }
}

Vec2 BilinearDistribution::sample(const Vec2& u, float& pdf_out) const {
  const auto row_integral = [&](int y) { return m_conditional[static_cast<std::size_t>(y) * m_width + m_width - 1]; };

  const float target_v = u.y * m_marginal.back();
  const int y =
      static_cast<int>(std::upper_bound(m_marginal.begin() + 1, m_marginal.end() - 1, target_v) - m_marginal.begin()) -
      1;
  const float r0 = row_integral(y), r1 = row_integral(y + 1);
  const float share = m_marginal[y + 1] - m_marginal[y];
  const float in_row = share > 0 ? (target_v - m_marginal[y]) / share : 0.0f;
  const float tv = sample_linear(r0, r1, in_row * 0.5f * (r0 + r1));

  const float* c0 = &m_conditional[static_cast<std::size_t>(y) * m_width];
  const float* c1 = c0 + m_width;
  const float target_u = u.x * ((1 - tv) * r0 + tv * r1);
  int low = 0, high = m_width - 1;  // cdf(low) <= target < cdf(high)
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    ((1 - tv) * c0[middle] + tv * c1[middle] <= target_u ? low : high) = middle;
  }
  const float a = (1 - tv) * value(low, y) + tv * value(low, y + 1);
  const float b = (1 - tv) * value(low + 1, y) + tv * value(low + 1, y + 1);
  const float tu = sample_linear(a, b, target_u - ((1 - tv) * c0[low] + tv * c1[low]));
  pdf_out = (1 - tu) * a + tu * b;
  return {(static_cast<float>(low) + tu) / static_cast<float>(m_width - 1),
          (static_cast<float>(y) + tv) / static_cast<float>(m_height - 1)};
}

float BilinearDistribution::pdf(const Vec2& position) const {
  const float px = clamp01(position.x) * static_cast<float>(m_width - 1);
  const float py = clamp01(position.y) * static_cast<float>(m_height - 1);
  const int x = std::min(static_cast<int>(px), m_width - 2), y = std::min(static_cast<int>(py), m_height - 2);
  const float tx = px - static_cast<float>(x), ty = py - static_cast<float>(y);
  return (1 - ty) * ((1 - tx) * value(x, y) + tx * value(x + 1, y)) +
         ty * ((1 - tx) * value(x, y + 1) + tx * value(x + 1, y + 1));
}

}  // namespace warpath
