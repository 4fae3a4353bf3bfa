#include "warp/halving_density.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "warpath/error.h"

namespace warpath {

HalvingGrid::HalvingGrid(std::array<int, 3> bits, int parts) : m_levels(bits[0] + bits[1] + bits[2]), m_bits(bits) {
  WARPATH_CHECK(m_levels <= kMaxLevels);
  m_parts = parts > 0 ? static_cast<std::uint32_t>(parts) : 1u << bits[0];
  WARPATH_CHECK(m_parts <= 1u << bits[0]);
  std::array<int, 3> used{};
  for (int level = 0; level < m_levels;) {
    for (int a = 0; a < 3; ++a) {
      // The choice comes first, whole; the others take turns.
      const auto i = static_cast<std::size_t>(a);
      for (int k = a == 0 ? bits[0] - used[0] : std::min(1, bits[i] - used[i]); k > 0; --k) {
        m_axis[static_cast<std::size_t>(level++)] = static_cast<std::uint8_t>(a);
        ++used[i];
      }
    }
  }
  m_scale = {static_cast<float>(m_parts), static_cast<float>(1 << bits[1]), static_cast<float>(1 << bits[2])};
  for (std::size_t a = 0; a < 3; ++a) m_unit[a] = 1 / static_cast<double>(m_scale[a]);
  m_volume = static_cast<float>(m_unit[0] * m_unit[1] * m_unit[2]);
}

std::uint32_t HalvingGrid::part_of(std::uint32_t bin) const { return bin >> (m_levels - m_bits[0]); }

std::uint32_t HalvingGrid::bin(float y0, float y1, float y2) const {
  const std::array<float, 3> y{y0, y1, y2};
  std::array<std::uint32_t, 3> place;
  std::array<int, 3> left = m_bits;
  for (std::size_t a = 0; a < 3; ++a)
    place[a] = std::min(static_cast<std::uint32_t>(y[a] * m_scale[a]), static_cast<std::uint32_t>(m_scale[a]) - 1);
  std::uint32_t bin = 0;
  for (int level = 0; level < m_levels; ++level) {
    const std::size_t a = m_axis[static_cast<std::size_t>(level)];
    bin = 2 * bin + (place[a] >> --left[a] & 1);
  }
  return bin;
}

float HalvingGrid::sample(const float* left, const std::array<double, 3>& z, std::array<float, 3>& y) const {
  // Instead of stretching z to [0,1) after each halving, `width` keeps track of how wide its range has become.
  std::array<double, 3> offset = z, width{1, 1, 1};
  std::array<std::uint32_t, 3> place{};
  std::uint32_t node = 1;
  for (int level = 0; level < m_levels; ++level) {
    const std::size_t a = m_axis[static_cast<std::size_t>(level)];
    const double p = left[node], first = p * width[a];
    // p = 1 leaves no second half, whatever rounding did to the offset.
    const bool second = offset[a] >= first && p < 1;
    offset[a] -= second ? first : 0;
    width[a] = second ? width[a] - first : first;
    place[a] = 2 * place[a] + second;
    node = 2 * node + second;
  }
  for (std::size_t a = 0; a < 3; ++a) {
    const double within = width[a] > 0 ? std::min(offset[a] / width[a], 1.0) : 0.5;
    // The last float below the bin's end: the sample must not leave the bin whose density it is divided by.
    const float begin = static_cast<float>(place[a] * m_unit[a]);
    const float end = static_cast<float>((place[a] + 1) * m_unit[a]);
    y[a] = std::clamp(static_cast<float>((place[a] + within) * m_unit[a]), begin, std::nextafter(end, begin));
  }
  return static_cast<float>(m_volume / (width[0] * width[1] * width[2]));
}

float HalvingGrid::inverse_density(const float* left, std::uint32_t bin) const {
  double q = 1;
  std::uint32_t node = 1;
  for (int level = m_levels - 1; level >= 0; --level) {
    const std::uint32_t second = bin >> level & 1;
    q *= second ? 1 - static_cast<double>(left[node]) : left[node];
    node = 2 * node + second;
  }
  return static_cast<float>(m_volume / q);
}

void halving_probabilities(std::span<const float> masses, std::span<float> left) {
  const std::size_t bins = masses.size();
  static thread_local std::vector<double> mass;
  mass.assign(2 * bins, 0);
  std::copy(masses.begin(), masses.end(), mass.begin() + static_cast<std::ptrdiff_t>(bins));
  for (std::size_t node = bins - 1; node > 0; --node) {
    mass[node] = mass[2 * node] + mass[2 * node + 1];
    left[node] = mass[node] > 0 ? static_cast<float>(mass[2 * node] / mass[node]) : 0.5f;
  }
  left[0] = 0;
}

}  // namespace warpath
