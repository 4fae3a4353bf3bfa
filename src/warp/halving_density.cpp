#include "warp/halving_density.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include "warpath/error.h"

namespace warpath {
namespace {

/// The largest float below a positive one.
float below(float x) { return std::bit_cast<float>(std::bit_cast<std::uint32_t>(x) - 1); }

/// Cumulative probabilities of children with these masses: one unit for each that has some mass, and their share of the
/// rest, rounded where it ends, so that no error adds up.
void set_node(std::span<const double> masses, std::span<CumulativeProbability> cumulative) {
  double sum = 0;
  int units = 0;
  for (const double mass : masses) sum += mass, units += mass > 0;
  std::fill(cumulative.begin(), cumulative.end(), static_cast<CumulativeProbability>(kWholeProbability));
  if (units == 0) return;
  const double rest = (kWholeProbability - units) / sum;
  double reached = 0;
  int begun = 0;
  for (std::size_t c = 0; c < masses.size(); ++c) {
    reached += masses[c] * rest;
    begun += masses[c] > 0;
    if (begun < units) cumulative[c] = static_cast<CumulativeProbability>(begun + static_cast<int>(reached + 0.5));
  }
}

}  // namespace

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
  std::uint32_t nodes = 0;
  std::array<int, 3> left = bits;
  for (int level = 0; level < m_levels; level += kNodeLevels) {
    Rank& rank = m_ranks[m_depth];
    rank.first = nodes;
    rank.levels = static_cast<std::uint32_t>(std::min(kNodeLevels, m_levels - level));
    rank.driver = (m_depth + 1) % 3;
    for (std::uint32_t k = 0; k < rank.levels; ++k) {
      const std::size_t a = m_axis[static_cast<std::size_t>(level) + k];
      --left[a];
      for (std::uint32_t c = 0; c < 1u << rank.levels; ++c)
        rank.place[c][a] |= (c >> (rank.levels - 1 - k) & 1) << left[a];
    }
    nodes += 1u << level;
    ++m_depth;
  }
  m_stored = std::size_t{nodes} * kChildren;
  m_scale = {static_cast<float>(m_parts), static_cast<float>(1 << bits[1]), static_cast<float>(1 << bits[2])};
  for (std::size_t a = 0; a < 3; ++a) m_unit[a] = 1 / static_cast<double>(m_scale[a]);
  const double volume = m_unit[0] * m_unit[1] * m_unit[2];
  m_volume = static_cast<float>(volume);
  m_whole = volume * std::pow(kWholeProbability, m_depth);
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

std::uint32_t HalvingGrid::node_above(std::uint32_t bin, std::uint32_t depth) const {
  return m_ranks[depth].first + (bin >> (m_levels - kNodeLevels * static_cast<int>(depth)));
}

std::uint32_t HalvingGrid::child_above(std::uint32_t bin, std::uint32_t depth) const {
  const std::uint32_t levels = m_ranks[depth].levels;
  const int below = m_levels - kNodeLevels * static_cast<int>(depth) - static_cast<int>(levels);
  return bin >> below & ((1u << levels) - 1);
}

void HalvingGrid::set_density(std::span<const float> masses, CumulativeProbability* density) const {
  static thread_local std::vector<double> mass;
  const std::uint32_t count = bins();
  mass.resize(2 * count);
  std::copy(masses.begin(), masses.end(), mass.begin() + count);
  for (std::uint32_t node = count - 1; node > 0; --node) mass[node] = mass[2 * node] + mass[2 * node + 1];
  for (std::uint32_t depth = 0; depth < m_depth; ++depth) {
    const std::uint32_t nodes = 1u << (kNodeLevels * depth), children = 1u << m_ranks[depth].levels;
    for (std::uint32_t i = 0; i < nodes; ++i)
      set_node(std::span(mass).subspan((nodes + i) * children, children),
               {density + (m_ranks[depth].first + i) * kChildren, kChildren});
  }
}

bool HalvingGrid::is_density(std::span<const CumulativeProbability> numbers) const {
  if (numbers.size() != m_stored) return false;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] < (i % kChildren ? numbers[i - 1] : 0)) return false;
    if (i % kChildren == kChildren - 1 && numbers[i] != kWholeProbability) return false;
  }
  // A child that is not there has no bin.
  for (std::uint32_t b = 0; b < bins(); ++b)
    if (volume(b) == 0 && inverse_density(numbers.data(), b) < HUGE_VALF) return false;
  return true;
}

void HalvingGrid::Walk::start(const HalvingGrid& grid, const CumulativeProbability* density,
                              const std::array<double, 3>& z) {
  m_grid = &grid;
  m_density = density;
  m_z = z;
  m_place = {};
  m_probability = 1;
  m_node = 0;
  m_depth = 0;
  __builtin_prefetch(density);
}

bool HalvingGrid::Walk::step() {
  const Rank& rank = m_grid->m_ranks[m_depth];
  const CumulativeProbability* cumulative = m_density + m_node * kChildren;
  const double reached = m_z[rank.driver] * kWholeProbability;
  const auto unit = static_cast<CumulativeProbability>(std::min(static_cast<int>(reached), kWholeProbability - 1));
  CumulativeProbability passed = 0;  // children that end at or before it
  for (std::uint32_t c = 0; c < kChildren; ++c)
    passed = static_cast<CumulativeProbability>(passed + (unit >= cumulative[c]));
  const auto child = static_cast<std::uint32_t>(passed);
  const int begin = child > 0 ? cumulative[child - 1] : 0, width = cumulative[child] - begin;
  m_z[rank.driver] = (reached - begin) / width;
  m_probability *= width;
  for (std::size_t a = 0; a < 3; ++a) m_place[a] += rank.place[child][a];
  if (++m_depth == m_grid->m_depth) return false;
  m_node = m_grid->m_ranks[m_depth].first + (m_node - rank.first) * kChildren + child;
  __builtin_prefetch(m_density + m_node * kChildren);
  return true;
}

std::array<float, 3> HalvingGrid::point(const std::array<std::uint32_t, 3>& place,
                                        const std::array<double, 3>& z) const {
  std::array<float, 3> y;
  for (std::size_t a = 0; a < 3; ++a) {
    // The last float below the bin's end: the sample must not leave the bin whose density it is divided by.
    const float begin = static_cast<float>(place[a] * m_unit[a]);
    const float end = static_cast<float>((place[a] + 1) * m_unit[a]);
    y[a] = std::clamp(static_cast<float>((place[a] + z[a]) * m_unit[a]), begin, below(end));
  }
  return y;
}

float HalvingGrid::Walk::finish(std::array<float, 3>& y) const {
  y = m_grid->point(m_place, m_z);
  return static_cast<float>(m_grid->m_whole / m_probability);
}

float HalvingGrid::sample(const CumulativeProbability* density, const std::array<double, 3>& z,
                          std::array<float, 3>& y) const {
  Walk walk;
  walk.start(*this, density, z);
  while (walk.step()) {
  }
  return walk.finish(y);
}

float HalvingGrid::inverse_density(const CumulativeProbability* density, std::uint32_t bin) const {
  double probability = 1;
  for (std::uint32_t depth = 0; depth < m_depth; ++depth) {
    const CumulativeProbability* cumulative = density + node_above(bin, depth) * kChildren;
    const std::uint32_t child = child_above(bin, depth);
    probability *= cumulative[child] - (child > 0 ? cumulative[child - 1] : 0);
  }
  return static_cast<float>(m_whole / probability);
}

}  // namespace warpath
