#include "train/field_learner.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::uint16_t kNoBin = 0xffff;
constexpr std::size_t kKinds = 6;  // of surfaces, see SurfaceKind

constexpr std::size_t kFeatures = FieldTree::kFeatures;

/// Effective samples of a cell over all of them, where a field does not tell: a typical share.
constexpr double kEffective = 0.1;

/// Whether what is scattered depends on where the path came from.
bool follows_direction(SurfaceKind kind) { return kind != SurfaceKind::diffuse && kind != SurfaceKind::null; }

}  // namespace

/// What a batch leaves: one entry for each vertex.
class FieldLearner::Recorder final : public VertexRecorder {
 public:
  struct Entry {
    std::uint32_t root_key, cell;
    std::uint16_t light_bin, scatter_bin;  // kNoBin: not drawn
    float light, scatter;                  // f / q
    float inv_q_light, inv_q_scatter;
    FieldTree::Features at;
  };
  Recorder(const FieldSettings& settings, const FieldGrids& grids, std::shared_ptr<const FieldTree> tree)
      : m_numbers(settings.numbers), m_grids(grids), m_tree(std::move(tree)) {}

  void record(const VertexRecords& records) override {
    const auto holds = [&](VertexDecision which) { return holds_decision(m_numbers, which, records.bounce); };
    if (!holds(VertexDecision::light_sampling) && !holds(VertexDecision::scattering)) return;
    const auto& u = records.numbers;
    const auto finite = [](float term) { return std::isfinite(term) ? term : 0.0f; };
    const std::size_t n = records.lanes.size();
    m_cells.resize(std::max(m_cells.size(), n));
    m_tree->find_cells(records.context, n, m_cells.data());
    for (std::size_t i = 0; i < n; ++i) {
      Entry entry;
      entry.root_key = FieldTree::root_key(records.context, i);
      entry.at = FieldTree::features(records.context, i);
      entry.cell = m_cells[i];
      const auto kind = static_cast<SurfaceKind>(records.context.kind[i]);
      const bool lit = kind != SurfaceKind::delta && kind != SurfaceKind::null;
      entry.light_bin = lit ? static_cast<std::uint16_t>(m_grids.light.bin(u[0][i], u[1][i], u[2][i])) : kNoBin;
      entry.scatter_bin =
          static_cast<std::uint16_t>(m_grids.grid(VertexDecision::scattering, kind).bin(u[3][i], u[4][i], u[5][i]));
      entry.light = finite(records.light_return[i]);
      entry.scatter = finite(records.scatter_return[i]);
      entry.inv_q_light = records.inv_q_light[i];
      entry.inv_q_scatter = records.inv_q_scatter[i];
      entries.push_back(entry);
    }
  }

  std::vector<Entry> entries;

 private:
  const Layout& m_numbers;
  const FieldGrids& m_grids;
  const std::shared_ptr<const FieldTree> m_tree;
  std::vector<std::uint32_t> m_cells;  // of the vertices of one bounce
};

FieldLearner::FieldLearner(const FieldSettings& settings, int light_parts)
    : m_settings(settings), m_grids(light_parts) {
  check_decisions(settings.numbers);
}

void FieldLearner::start_from(const Field& field) {
  if (field.grids().light_parts != m_grids.light_parts)
    throw ConfigError(fmt::format("a field for {} equally likely lights, but there are {}: it is of another scene",
                                  field.grids().light_parts, m_grids.light_parts));
  m_tree = field.tree();
  m_tree_of_pass = std::make_shared<const FieldTree>(m_tree);
  m_cells.assign(m_tree.cells(), {});
  m_light.assign(m_tree.cells() * m_grids.light.bins(), {});
  m_scatter.assign(m_tree.cells() * m_grids.diffuse.bins(), {});
  for (std::uint32_t c = 0; c < m_tree.cells(); ++c) {
    Cell& cell = m_cells[c];
    cell.kind = field.kind(c);
    const auto take = [&](VertexDecision which, CellDraws& draws, std::span<CellBin> bins) {
      const auto& [mean, learned] = field.returns(which, c);
      draws.learned = learned;
      if (!(learned > 0)) return;
      draws.n = m_settings.split_at;
      draws.sum = mean * draws.n;
      draws.square = draws.sum * draws.sum / (draws.n * kEffective);
      const HalvingGrid& grid = m_grids.grid(which, cell.kind);
      for (std::uint32_t b = 0; b < grid.bins(); ++b) {
        if (!(grid.volume(b) > 0)) continue;
        const float q = 1 / grid.inverse_density(field.density(which, c), b);
        const auto drawn = static_cast<float>(draws.n) * grid.volume(b);
        bins[b] = {mean * std::max(1 + (q - 1) / learned, 0.0f) * drawn, q * drawn};
      }
    };
    take(VertexDecision::light_sampling, cell.light,
         std::span(m_light).subspan(c * m_grids.light.bins(), m_grids.light.bins()));
    take(VertexDecision::scattering, cell.scatter,
         std::span(m_scatter).subspan(c * m_grids.diffuse.bins(), m_grids.diffuse.bins()));
  }
}

std::unique_ptr<VertexRecorder> FieldLearner::make_recorder() const {
  return std::make_unique<Recorder>(m_settings, m_grids, m_tree_of_pass);
}

void FieldLearner::add_root(std::uint32_t key) {
  m_tree.add_root(key);
  m_cells.emplace_back().kind = FieldTree::kind_of(key);
  m_light.resize(m_cells.size() * m_grids.light.bins());
  m_scatter.resize(m_cells.size() * m_grids.diffuse.bins());
}

void FieldLearner::merge(VertexRecorder& recorder) {
  auto& entries = static_cast<Recorder&>(recorder).entries;
  constexpr std::size_t kAhead = 16;
  const std::size_t light_bins = m_grids.light.bins(), scatter_bins = m_grids.diffuse.bins();
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (i + kAhead < entries.size()) {
      const Recorder::Entry& next = entries[i + kAhead];
      if (next.cell != FieldTree::kNoCell) {
        if (next.light_bin != kNoBin) __builtin_prefetch(&m_light[next.cell * light_bins + next.light_bin], 1);
        __builtin_prefetch(&m_scatter[next.cell * scatter_bins + next.scatter_bin], 1);
      }
    }
    Recorder::Entry& e = entries[i];
    if (e.cell == FieldTree::kNoCell) {
      // Either new altogether, or another entry has brought it in since this one was recorded.
      e.cell = m_tree.cell(e.root_key, e.at);
      if (e.cell == FieldTree::kNoCell) {
        e.cell = m_tree.cells();
        add_root(e.root_key);
      }
    }
    Cell& cell = m_cells[e.cell];
    cell.visits += 1;
    for (std::size_t k = 0; k < FieldTree::kFeatures; ++k) {
      cell.sum[k] += e.at[k];
      cell.square[k] += static_cast<double>(e.at[k]) * e.at[k];
    }
    if (e.light_bin != kNoBin) {
      CellBin& bin = m_light[e.cell * light_bins + e.light_bin];
      bin.sum += e.light;
      bin.draws += 1;
      cell.light.add(e.light, e.inv_q_light);
    }
    CellBin& bin = m_scatter[e.cell * scatter_bins + e.scatter_bin];
    bin.sum += e.scatter;
    bin.draws += 1;
    cell.scatter.add(e.scatter, e.inv_q_scatter);
  }
  entries.clear();
}

void FieldLearner::cut_cells() {
  double n = 0;
  std::array<double, kFeatures> sum{}, square{};
  for (const Cell& cell : m_cells) {
    n += cell.visits;
    for (std::size_t k = 0; k < kFeatures; ++k) sum[k] += cell.sum[k], square[k] += cell.square[k];
  }
  // An angle seen from a distance that is typical of the scene is as wide as this on a surface.
  double extent2 = 0;
  for (std::size_t k = 0; k < 3; ++k) extent2 += std::max(0.0, square[k] / n - (sum[k] / n) * (sum[k] / n));
  // Cells that are new are looked at in their turn: they may still be too large.
  for (std::uint32_t cell = 0; cell < m_cells.size(); ++cell)
    while (m_cells[cell].visits > m_settings.split_at && m_cells.size() < m_settings.max_cells && cut(cell, extent2)) {
    }
}

bool FieldLearner::cut(std::uint32_t index, double extent2) {
  const Cell parent = m_cells[index];  // a copy: m_cells grows
  const double n = parent.visits;
  std::array<double, kFeatures> mean, variance;
  for (std::size_t k = 0; k < kFeatures; ++k) {
    mean[k] = parent.sum[k] / n;
    variance[k] = std::max(0.0, parent.square[k] / n - mean[k] * mean[k]);
  }
  std::size_t feature = 0;
  const std::size_t features = follows_direction(parent.kind) ? kFeatures : 3;
  const auto width = [&](std::size_t k) { return k < 3 ? variance[k] : variance[k] * extent2; };
  for (std::size_t k = 1; k < features; ++k)
    if (width(k) > width(feature)) feature = k;
  if (!(width(feature) > 1e-9 * extent2)) return false;  // all in one place

  const std::uint32_t upper = m_tree.split(index, feature, static_cast<float>(mean[feature]));
  const auto halve = [&](std::vector<CellBin>& bins, std::size_t size) {
    bins.resize(bins.size() + size);
    for (std::size_t b = 0; b < size; ++b) {
      CellBin& bin = bins[index * size + b];
      bin.sum *= 0.5f, bin.draws *= 0.5f;
      bins[upper * size + b] = bin;
    }
  };
  halve(m_light, m_grids.light.bins());
  halve(m_scatter, m_grids.diffuse.bins());
  // The halves of vertices that lie evenly: where their means are, and how wide they are.
  const double offset = std::sqrt(0.75 * variance[feature]);
  const auto half = [&](double side) {
    Cell cell = parent;
    cell.visits *= 0.5;
    cell.light.halve(), cell.scatter.halve();
    for (std::size_t k = 0; k < kFeatures; ++k) {
      const double m = k == feature ? mean[k] + side * offset : mean[k];
      cell.sum[k] = m * cell.visits;
      cell.square[k] = ((k == feature ? 0.25 : 1.0) * variance[k] + m * m) * cell.visits;
    }
    return cell;
  };
  m_cells[index] = half(-1);
  m_cells.push_back(half(1));
  return true;
}

std::shared_ptr<const Field> FieldLearner::fit_field() {
  if (!m_cells.empty()) cut_cells();
  m_tree_of_pass = std::make_shared<const FieldTree>(m_tree);
  const std::size_t light_bins = m_grids.light.bins(), scatter_bins = m_grids.diffuse.bins();
  const std::size_t light_stored = m_grids.light.stored(), scatter_stored = m_grids.diffuse.stored();
  std::vector<CumulativeProbability> light(m_cells.size() * light_stored), scatter(m_cells.size() * scatter_stored);
  std::array<PooledShares, kKinds> light_shares, scatter_shares;
  for (const Cell& cell : m_cells) {
    light_shares[static_cast<std::size_t>(cell.kind)].add(cell.light);
    scatter_shares[static_cast<std::size_t>(cell.kind)].add(cell.scatter);
  }
  const auto fit_density = [&](const HalvingGrid& grid, std::span<const CellBin> bins, const PooledShares& like,
                               CellDraws& draws, CumulativeProbability* density) {
    static thread_local std::vector<float> masses;
    masses.resize(grid.bins());
    const double uniform = best_uniform_share(draws, like.mean(), m_settings.first_uniform_share);
    draws.begin_pass(fit_cell_density(grid, bins, draws, {m_settings.shrink, m_settings.trust, uniform}, masses));
    grid.set_density(masses, density);
  };
  tbb::parallel_for(std::size_t{0}, m_cells.size(), [&](std::size_t c) {
    Cell& cell = m_cells[c];
    const auto kind = static_cast<std::size_t>(cell.kind);
    fit_density(m_grids.light, std::span(m_light).subspan(c * light_bins, light_bins), light_shares[kind], cell.light,
                light.data() + c * light_stored);
    fit_density(m_grids.grid(VertexDecision::scattering, cell.kind),
                std::span(m_scatter).subspan(c * scatter_bins, scatter_bins), scatter_shares[kind], cell.scatter,
                scatter.data() + c * scatter_stored);
  });
  std::vector<SurfaceKind> kinds;
  std::vector<Field::Returns> returns;
  for (const Cell& cell : m_cells) {
    kinds.push_back(cell.kind);
    const auto told = [](const CellDraws& draws) {
      return Field::Return{static_cast<float>(draws.mean()), draws.learned};
    };
    returns.push_back({told(cell.light), told(cell.scatter)});
  }
  return std::make_shared<Field>(m_tree, m_grids, std::move(kinds), std::move(light), std::move(scatter),
                                 std::move(returns), m_settings.numbers);
}

}  // namespace warpath
