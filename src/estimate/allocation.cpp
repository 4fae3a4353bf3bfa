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

PixelMoments& PixelMoments::operator+=(const PixelMoments& other) {
  for (std::size_t p = 0; p < m_moments.size(); ++p) {
    m_moments[p].n += other.m_moments[p].n;
    for (int c = 0; c < 3; ++c) {
      m_moments[p].sum[c] += other.m_moments[p].sum[c];
      m_moments[p].square[c] += other.m_moments[p].square[c];
    }
  }
  return *this;
}

std::vector<double> PixelMoments::deviations(Objective objective, const PixelMoments& means) const {
  struct Pooled {
    double n = 0, spread[3]{};  // spread: n times the variance of one sample
    double mean_n = 0, sum[3]{};
    Pooled& operator+=(const Pooled& o) {
      n += o.n, mean_n += o.mean_n;
      for (int c = 0; c < 3; ++c) spread[c] += o.spread[c], sum[c] += o.sum[c];
      return *this;
    }
  };
  std::vector<Pooled> pooled(m_moments.size());
  for (std::size_t p = 0; p < pooled.size(); ++p) {
    const Moments &m = m_moments[p], &of_mean = means.m_moments[p];
    pooled[p].mean_n = of_mean.n;
    std::copy_n(of_mean.sum, 3, pooled[p].sum);
    if (m.n < 2) continue;
    pooled[p].n = m.n;
    for (int c = 0; c < 3; ++c)
      pooled[p].spread[c] = std::max(0.0, m.square[c] - m.sum[c] * m.sum[c] / m.n) * m.n / (m.n - 1);
  }
  pool(pooled, m_width, m_height);
  std::vector<double> deviations(pooled.size());
  for (std::size_t p = 0; p < pooled.size(); ++p) {
    const Pooled& around = pooled[p];
    if (around.n == 0) continue;
    double error = 0;
    for (int c = 0; c < 3; ++c) {
      const double mean = around.sum[c] / around.mean_n;
      error += around.spread[c] / around.n / (objective == Objective::relmse ? mean * mean + kRelativeFloor : 1);
    }
    deviations[p] = std::sqrt(error / 3);
  }
  return deviations;
}

std::vector<float> PixelMoments::brightness() const {
  struct Pooled {
    double n = 0, sum = 0;
    Pooled& operator+=(const Pooled& o) {
      n += o.n, sum += o.sum;
      return *this;
    }
  };
  std::vector<Pooled> pooled;
  for (const Moments& m : m_moments) pooled.push_back({m.n, luminance(Color(m.sum[0], m.sum[1], m.sum[2]))});
  pool(pooled, m_width, m_height);
  std::vector<float> brightness;
  for (const Pooled& around : pooled)
    brightness.push_back(static_cast<float>(around.n > 0 ? around.sum / around.n : 0));
  return brightness;
}

double PixelMoments::error(std::optional<Objective> objective, const PixelMoments& means) const {
  double sum = 0, square = 0;
  const std::vector<double> deviation = deviations(objective.value_or(Objective::relmse), means);
  for (const double d : deviation) sum += d, square += d * d;
  const auto pixels = static_cast<double>(deviation.size());
  return objective ? (sum / pixels) * (sum / pixels) : square / pixels;
}

std::vector<std::uint32_t> PixelMoments::allocate(int spp, Objective objective, double u) const {
  const std::size_t pixels = m_moments.size();
  std::vector<double> want = deviations(objective, *this);
  double sum = 0;
  for (const double w : want) sum += w;
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
