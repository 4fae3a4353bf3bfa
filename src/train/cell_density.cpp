#include "train/cell_density.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "warpath/error.h"

namespace warpath {
namespace {

/// A difference between the halves of a node is believed as far as its chi-squared exceeds this.
constexpr double kByChance = 4;

/// Binary heaps over the halvings of a grid: node 1 is the whole, 2 i and 2 i + 1 are the halves of i, and the last
/// bins() nodes are the bins.
struct Nodes {
  std::vector<double> sum, draws, volume, expected;

  void add_up(const HalvingGrid& grid, std::span<const CellBin> bins) {
    const std::uint32_t count = grid.bins();
    for (auto* heap : {&sum, &draws, &volume, &expected}) heap->resize(2 * count);
    for (std::uint32_t b = 0; b < count; ++b) {
      sum[count + b] = bins[b].sum;
      draws[count + b] = bins[b].draws;
      volume[count + b] = grid.volume(b);
    }
    for (std::uint32_t node = count - 1; node > 0; --node)
      for (auto* heap : {&sum, &draws, &volume}) (*heap)[node] = (*heap)[2 * node] + (*heap)[2 * node + 1];
  }
  /// How far what a node itself has seen is believed against the whole that it is part of.
  double belief(std::uint32_t node, double hit, double shrink) const {
    const double by_draws = draws[node] / (draws[node] + shrink);
    const double hits = sum[node / 2] / hit, alike = volume[node] / volume[node / 2];
    if (!(hits > 0 && alike > 0 && alike < 1)) return by_draws;
    const double difference = sum[node] / sum[node / 2] - alike;
    const double chi_squared = hits * difference * difference / (alike * (1 - alike));
    return chi_squared > kByChance ? std::max(by_draws, 1 - kByChance / chi_squared) : by_draws;
  }
};

}  // namespace

double fit_cell_density(const HalvingGrid& grid, std::span<const CellBin> bins, const CellDraws& draws,
                        const CellBelief& belief, std::span<float> masses) {
  const std::uint32_t count = grid.bins();
  WARPATH_CHECK_EQ(bins.size(), std::size_t{count});
  WARPATH_CHECK_EQ(masses.size(), std::size_t{count});
  static thread_local Nodes nodes;
  nodes.add_up(grid, bins);
  auto& [sum, drawn, volume, expected] = nodes;
  const double hit = draws.sum > 0 ? draws.square / draws.sum : 1;
  expected[1] = draws.n > 0 ? sum[1] / draws.n : 0;
  double total = 0;
  for (std::uint32_t node = 2; node < 2 * count; ++node) {
    const double own = volume[node] > 0 && draws.n > 0 ? sum[node] / (draws.n * volume[node]) : 0;
    const double believed = nodes.belief(node, hit, belief.shrink);
    expected[node] = believed * own + (1 - believed) * expected[node / 2];
    if (node >= count) total += expected[node] * volume[node];
  }
  const double effective = draws.effective();
  const double share = total > 0 ? (1 - belief.uniform) * effective / (effective + belief.trust) : 0;
  for (std::uint32_t b = 0; b < count; ++b)
    masses[b] =
        static_cast<float>(volume[count + b] * (1 - share + (share > 0 ? share * expected[count + b] / total : 0)));
  return share;
}

}  // namespace warpath
