#include "warp/halving_density.h"

#include <algorithm>
#include <bit>
#include <vector>

#include "warpath/error.h"

namespace warpath {
namespace {

constexpr int kSubtreeLevels = 4;
constexpr std::uint32_t kSubtree = 1u << kSubtreeLevels;  // numbers of a subtree, the first of which is not used

/// Subtree s has the children 16 s + 1 ... 16 s + 16.
constexpr std::uint32_t child(std::uint32_t subtree, std::uint32_t leaf) { return subtree * kSubtree + 1 + leaf; }

/// Walks down the tree of halvings and knows where the probability of the node it stands on is stored.
class Descent {
 public:
  std::size_t place() const { return m_subtree * kSubtree + m_node; }
  void go(bool second) {
    m_node = 2 * m_node + second;
    if (m_node < kSubtree) return;
    m_subtree = child(m_subtree, m_node - kSubtree);
    m_node = 1;
  }

 private:
  std::uint32_t m_subtree = 0, m_node = 1;
};

/// The largest float below a positive one.
float below(float x) { return std::bit_cast<float>(std::bit_cast<std::uint32_t>(x) - 1); }

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
  std::size_t subtrees = 0;
  for (int level = 0; level < m_levels; level += kSubtreeLevels) subtrees += std::size_t{1} << level;
  m_stored = subtrees * kSubtree;
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

void HalvingGrid::set_density(std::span<const float> masses, HalfProbability* density) const {
  static thread_local std::vector<double> mass;
  const std::uint32_t count = bins();
  mass.resize(2 * count);
  std::copy(masses.begin(), masses.end(), mass.begin() + count);
  for (std::uint32_t node = count - 1; node > 0; --node) mass[node] = mass[2 * node] + mass[2 * node + 1];
  std::fill_n(density, m_stored, HalfProbability{0});
  for (int level = 0; level < m_levels; ++level)
    for (std::uint32_t node = 1u << level; node < 2u << level; ++node) {
      Descent walk;
      for (int k = level - 1; k >= 0; --k) walk.go(node >> k & 1);
      const double first = mass[2 * node], second = mass[2 * node + 1];
      int p = kWholeProbability / 2;
      if (second == 0 && first > 0) p = kWholeProbability;
      if (first == 0 && second > 0) p = 0;
      if (first > 0 && second > 0)
        p = std::clamp(static_cast<int>(first / (first + second) * kWholeProbability + 0.5), 1, kWholeProbability - 1);
      density[walk.place()] = static_cast<HalfProbability>(p);
    }
}

void HalvingGrid::Walk::start(const HalvingGrid& grid, const HalfProbability* density, const std::array<double, 3>& z) {
  m_grid = &grid;
  m_density = density;
  m_offset = z;
  m_width = {1, 1, 1};
  m_place = {};
  m_subtree = 0;
  m_level = 0;
  __builtin_prefetch(density);
}

bool HalvingGrid::Walk::step() {
  const HalfProbability* subtree = m_density + m_subtree * kSubtree;
  const int end = std::min(m_level + kSubtreeLevels, m_grid->m_levels);
  std::uint32_t node = 1;
  for (; m_level < end; ++m_level) {
    const std::size_t a = m_grid->m_axis[static_cast<std::size_t>(m_level)];
    const int p = subtree[node];
    const double first = p * (1.0 / kWholeProbability) * m_width[a];
    // A whole leaves no second half, whatever rounding did to the offset. No branches: they could not be predicted.
    const bool second = (m_offset[a] >= first) & (p < kWholeProbability);
    const double is_second = second;
    m_offset[a] -= is_second * first;
    m_width[a] = first + is_second * (m_width[a] - 2 * first);
    m_place[a] = 2 * m_place[a] + second;
    node = 2 * node + second;
  }
  if (m_level == m_grid->m_levels) return false;
  m_subtree = child(m_subtree, node - kSubtree);
  __builtin_prefetch(m_density + m_subtree * kSubtree);
  return true;
}

float HalvingGrid::Walk::finish(std::array<float, 3>& y) const {
  for (std::size_t a = 0; a < 3; ++a) {
    const double within = m_width[a] > 0 ? std::min(m_offset[a] / m_width[a], 1.0) : 0.5, unit = m_grid->m_unit[a];
    // The last float below the bin's end: the sample must not leave the bin whose density it is divided by.
    const float begin = static_cast<float>(m_place[a] * unit);
    const float end = static_cast<float>((m_place[a] + 1) * unit);
    y[a] = std::clamp(static_cast<float>((m_place[a] + within) * unit), begin, below(end));
  }
  return static_cast<float>(m_grid->m_volume / (m_width[0] * m_width[1] * m_width[2]));
}

float HalvingGrid::sample(const HalfProbability* density, const std::array<double, 3>& z,
                          std::array<float, 3>& y) const {
  Walk walk;
  walk.start(*this, density, z);
  while (walk.step()) {
  }
  return walk.finish(y);
}

float HalvingGrid::inverse_density(const HalfProbability* density, std::uint32_t bin) const {
  double q = 1;
  Descent walk;
  for (int level = m_levels - 1; level >= 0; --level) {
    const bool second = bin >> level & 1;
    const double p = density[walk.place()] * (1.0 / kWholeProbability);
    q *= second ? 1 - p : p;
    walk.go(second);
  }
  return static_cast<float>(m_volume / q);
}

}  // namespace warpath
