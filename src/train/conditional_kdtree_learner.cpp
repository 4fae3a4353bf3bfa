#include "train/conditional_kdtree_learner.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/rng.h"
#include "train/fit_kdtree.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::array kBoth{VertexDecision::light_sampling, VertexDecision::scattering};

FilmTiling tiling_of(const ConditionalKdTreeSettings& settings, int width, int height) {
  if (settings.tiles < 1 || settings.tiles > 1 << 10)
    throw ConfigError(fmt::format("{} tiles across the film, not 1 to {}", settings.tiles, 1 << 10));
  if (settings.tilings < 1 || settings.tilings > ConditionalKdTree::kMostTilings)
    throw ConfigError(fmt::format("{} tilings, not 1 to {}", settings.tilings, ConditionalKdTree::kMostTilings));
  const auto along = [&](int side) {
    return std::max(1, (settings.tiles * side + std::max(width, height) / 2) / std::max(width, height));
  };
  return {along(width), along(height), settings.tilings};
}

}  // namespace

class ConditionalKdTreeLearner::Recorder final : public VertexRecorder {
 public:
  Recorder(const Layout& numbers, float kept) : m_numbers(numbers), m_kept(kept) {}

  void record(const VertexRecords& records) override {
    const std::size_t n = records.lanes.size();
    bool any = false;
    for (const VertexDecision which : kBoth) {
      if (!holds_decision(m_numbers, which, records.bounce)) continue;
      any = true;
      const bool light = which == VertexDecision::light_sampling;
      const float* found = light ? records.light_return : records.scatter_return;
      const float* inv_q = light ? records.inv_q_light : records.inv_q_scatter;
      for (std::size_t i = 0; i < n; ++i) {
        Example e{{records.context.film[0][i], records.context.film[1][i]}, {}, 0, inv_q[i], 0};
        for (std::size_t a = 0; a < 3; ++a) e.y[a] = records.numbers[(light ? 0 : 3) + a][i];
        if (found[i] > 0 && std::isfinite(found[i])) e.weight = found[i];
        e.order = order_of(e);
        if (e.order < m_kept) examples[static_cast<std::size_t>(which)].push_back(e);
      }
    }
    if (any) seen += static_cast<double>(n);
  }

  std::array<Examples, 2> examples;
  double seen = 0;

 private:
  /// Chance that belongs to the numbers, whatever thread they came from.
  static float order_of(const Example& e) {
    const auto bits = [](float x) { return std::uint64_t{std::bit_cast<std::uint32_t>(x)}; };
    const std::uint64_t key = sample_key(bits(e.film[0]) << 32 | bits(e.film[1]), bits(e.y[1]) << 32 | bits(e.y[2]));
    return sample_float(key, std::bit_cast<std::uint32_t>(e.y[0]));
  }

  const Layout& m_numbers;
  const float m_kept;
};

ConditionalKdTreeLearner::ConditionalKdTreeLearner(const ConditionalKdTreeSettings& settings, int width, int height,
                                                   double uniform)
    : m_settings(settings), m_tiling(tiling_of(settings, width, height)), m_uniform(uniform) {
  if (settings.numbers.dims() == 0) throw ConfigError("a conditional kd-tree needs to be told which numbers it warps");
  check_decisions(settings.numbers);
  for (const Group group : settings.numbers.groups())
    if (group.bounce != settings.numbers.groups().front().bounce)
      throw ConfigError(fmt::format("a kd-tree for each part of the film warps the numbers of one vertex, not {}",
                                    settings.numbers.name()));
  if (settings.most_examples < 1) throw ConfigError("a conditional kd-tree must keep at least 1 example");
  if (!(uniform >= 0 && uniform < 1))
    throw ConfigError(fmt::format("the share of uniform samples is {}, not in [0, 1)", uniform));
}

std::unique_ptr<VertexRecorder> ConditionalKdTreeLearner::make_recorder() const {
  return std::make_unique<Recorder>(m_settings.numbers, m_kept);
}

void ConditionalKdTreeLearner::merge(VertexRecorder& recorder) {
  auto& r = static_cast<Recorder&>(recorder);
  for (std::size_t w = 0; w < m_examples.size(); ++w) {
    m_examples[w].insert(m_examples[w].end(), r.examples[w].begin(), r.examples[w].end());
    r.examples[w].clear();
  }
  m_seen += r.seen;
  r.seen = 0;
}

ConditionalKdTree::Trees ConditionalKdTreeLearner::grow(const Examples& examples) const {
  ConditionalKdTree::Trees trees(m_tiling.tiles());
  // Examples of each tile, one tiling after the other: order[begin[t]] ... order[begin[t + 1] - 1].
  std::vector<std::uint32_t> order(examples.size());
  for (int k = 0; k < m_tiling.tilings; ++k) {
    const std::size_t first = static_cast<std::size_t>(k) * m_tiling.tiles_of_one();
    const auto tile = [&](const Example& e) { return m_tiling.tile(k, e.film[0], e.film[1]) - first; };
    std::vector<std::size_t> begin(m_tiling.tiles_of_one() + 1);
    for (const Example& e : examples) ++begin[tile(e) + 1];
    for (std::size_t t = 1; t < begin.size(); ++t) begin[t] += begin[t - 1];
    std::vector<std::size_t> next = begin;
    for (std::uint32_t i = 0; i < examples.size(); ++i) order[next[tile(examples[i])]++] = i;
    tbb::parallel_for(std::size_t{0}, m_tiling.tiles_of_one(), [&](std::size_t t) {
      const std::size_t count = begin[t + 1] - begin[t];
      if (count < 2 * static_cast<std::size_t>(m_settings.tree.min_samples)) return;
      warpath::Examples rows;
      rows.y = Matrix<float>(count, 3);
      rows.weight.resize(count);
      rows.inv_q.resize(count);
      float most = 0;
      for (std::size_t i = 0; i < count; ++i) {
        const Example& e = examples[order[begin[t] + i]];
        std::copy_n(e.y.begin(), 3, &rows.y(i, 0));
        rows.weight[i] = e.weight;
        rows.inv_q[i] = e.inv_q;
        most = std::max(most, e.weight);
      }
      // In units of the largest: their squares must not leave the range of a float.
      for (float& weight : rows.weight) weight /= most;
      if (most > 0) trees[first + t] = fit_kdtree(std::move(rows), m_settings.tree)->nodes();
    });
  }
  return trees;
}

std::shared_ptr<const ConditionalKdTree> ConditionalKdTreeLearner::fit_trees() {
  auto warp = std::make_shared<const ConditionalKdTree>(m_tiling, std::array{grow(m_examples[0]), grow(m_examples[1])},
                                                        m_uniform, m_settings.numbers);
  // The next pass is as large as all before it.
  m_kept = std::min(m_kept, static_cast<float>(m_settings.most_examples / std::max(1.0, 2 * m_seen)));
  for (Examples& examples : m_examples) std::erase_if(examples, [&](const Example& e) { return e.order >= m_kept; });
  return warp;
}

}  // namespace warpath
