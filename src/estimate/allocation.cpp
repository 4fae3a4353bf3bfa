#include "estimate/allocation.h"

#include <algorithm>
#include <cmath>

namespace warpath {
namespace {

/// Moments are pooled over squares of 2 kReach + 1 pixels: a pixel's own samples are too few to know its variance by.
constexpr int kReach = 3;
/// Share of the samples that is spread evenly, so that a pixel whose light was not found yet gets some.
constexpr double kEven = 0.25;
/// No pixel gets more than this times the mean.
constexpr double kMost = 16;
/// relMSE divides by R^2 plus this.
constexpr double kRelativeFloor = 0.01;

/// Sums over squares of 2 kReach + 1, rows and columns in turn.
template <class Sum>
void pool(std::vector<Sum>& values, int width, int height) {
  std::vector<Sum> rows(values.size());
  const auto at = [width](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int i = std::max(0, x - kReach); i <= std::min(width - 1, x + kReach); ++i)
        rows[at(x, y)] += values[at(i, y)];
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      values[at(x, y)] = {};
      for (int j = std::max(0, y - kReach); j <= std::min(height - 1, y + kReach); ++j)
        values[at(x, y)] += rows[at(x, j)];
    }
}

}  // namespace

PixelMoments::PixelMoments(int width, int height)
    : m_width(width), m_height(height), m_moments(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

void PixelMoments::add(std::uint32_t pixel, const Color& value) {
  Moments& m = m_moments[pixel];
  m.n += 1;
  if (!std::isfinite(value.x + value.y + value.z)) return;
  for (int c = 0; c < 3; ++c) {
    m.sum[c] += value[c];
    m.square[c] += static_cast<double>(value[c]) * value[c];
  }
}

std::vector<std::uint32_t> PixelMoments::allocate(int spp, Objective objective, double u) const {
  const std::size_t pixels = m_moments.size();
  struct Pooled {
    double n = 0, sum[3]{}, spread[3]{};  // spread: n times the variance of one sample
    Pooled& operator+=(const Pooled& o) {
      n += o.n;
      for (int c = 0; c < 3; ++c) sum[c] += o.sum[c], spread[c] += o.spread[c];
      return *this;
    }
  };
  std::vector<Pooled> pooled(pixels);
  for (std::size_t p = 0; p < pixels; ++p) {
    const Moments& m = m_moments[p];
    if (m.n < 2) continue;
    pooled[p].n = m.n;
    for (int c = 0; c < 3; ++c) {
      pooled[p].sum[c] = m.sum[c];
      pooled[p].spread[c] = std::max(0.0, m.square[c] - m.sum[c] * m.sum[c] / m.n) * m.n / (m.n - 1);
    }
  }
  pool(pooled, m_width, m_height);
  // Standard deviation of one sample, over what the error divides by.
  const auto deviation = [objective](const Pooled& p) {
    if (p.n == 0) return 0.0;
    double error = 0;
    for (int c = 0; c < 3; ++c)
      error += p.spread[c] / p.n /
               (objective == Objective::relmse ? (p.sum[c] / p.n) * (p.sum[c] / p.n) + kRelativeFloor : 1);
    return std::sqrt(error);
  };

  std::vector<double> want(pixels);
  double sum = 0;
  for (std::size_t p = 0; p < pixels; ++p) sum += want[p] = deviation(pooled[p]);
  const double mean = sum / static_cast<double>(pixels);
  double capped = 0;
  for (double& w : want) capped += w = mean > 0 ? std::min(w / mean, kMost) : 1;
  // One sample each, then what is left by what is wanted.
  const double total = static_cast<double>(spp) * static_cast<double>(pixels),
               left = total - static_cast<double>(pixels);
  std::vector<std::uint32_t> counts(pixels);
  double reached = u;
  for (std::size_t p = 0; p < pixels; ++p) {
    const double share = kEven + (1 - kEven) * want[p] * static_cast<double>(pixels) / capped;
    const double next = reached + left / static_cast<double>(pixels) * share;
    counts[p] = 1 + static_cast<std::uint32_t>(std::floor(next) - std::floor(reached));
    reached = next;
  }
  return counts;
}

}  // namespace warpath
