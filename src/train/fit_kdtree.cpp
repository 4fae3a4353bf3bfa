#include "train/fit_kdtree.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>

#include "warp/load.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::size_t kBins = 16;         // places within a cell, per dimension, where it may be split
constexpr std::size_t kChunk = 1 << 15;   // rows that one task scans: fixed, so that sums do not depend on threads
constexpr std::size_t kSerial = 1 << 12;  // rows below which a subtree is grown by one task
constexpr int kMaxDepth = 100;
constexpr double kFloor = 1e-3;  // least density of a leaf, over the mean one

struct Box {
  std::array<float, KdTree::kMaxDims> low{}, high{};
};

struct Cell {
  double mean = 0;  // of the target (g or g^2) in the cell, drawn to the parent's
  double volume = 1;
  double gain = 0;  // what splitting it would gain
  int dim = -1;     // of the split; -1 if there is none worth it
  float split = 0;
  std::unique_ptr<std::array<Cell, 2>> children;  // if it has a split
  bool is_split = false;                          // whether that is used
};

struct Range {
  std::size_t begin, end;
  std::size_t size() const { return end - begin; }
};

/// Number of rows, sum of their values and of their squares.
struct Tally {
  double count = 0, sum = 0, square = 0;
  Tally& operator+=(const Tally& other) {
    count += other.count;
    sum += other.sum;
    square += other.square;
    return *this;
  }
  Tally operator-(const Tally& other) const { return {count - other.count, sum - other.sum, square - other.square}; }
};

class Grower {
 public:
  Grower(Examples examples, const KdTreeSettings& settings)
      : m_settings(settings), m_dims(examples.y.cols()), m_uniform(examples.inv_q.empty()) {
    m_total = static_cast<double>(examples.size());
    m_values[0] = std::move(examples.weight);
    if (settings.target == KdTreeSettings::Target::second_moment) {
      for (float& value : m_values[0]) value *= value;
      for (std::size_t i = 0; i < examples.inv_q.size(); ++i) m_values[0][i] /= examples.inv_q[i];
    }
    m_rows[0] = std::move(examples.y);
    m_rows[1] = Matrix<float>(m_rows[0].rows(), m_dims);
    m_values[1].resize(m_values[0].size());
  }

  Cell grow() {
    Cell root;
    Box box;
    box.high.fill(1.0f);
    double sum = 0;
    for (const float value : m_values[0]) sum += value;
    root.mean = sum / m_total;
    grow(root, box, {0, m_values[0].size()}, 0, 0);
    return root;
  }

 private:
  struct Split {
    double gain = 0;
    int dim = -1;
    float at = 0;
    Tally lower, upper;
    double shrink = 0;
  };

  /// By how many samples of a cell's own mean those of its parts are held back. A mean of n values with a coefficient
  /// of variation c has a relative error of c / sqrt(n): noisy values need more of them before they are believed,
  /// smooth ones hardly any.
  double shrinking_samples(const Tally& cell) const {
    if (m_settings.shrink == 0) return 0;
    constexpr double kLeast = 5;  // a few values, or zeros, may be alike by chance
    const double square = cell.sum > 0 ? cell.count * cell.square / (cell.sum * cell.sum) - 1 : 0;
    return kLeast + m_settings.shrink * std::max(0.0, square);
  }

  /// The mean in a part of a cell.
  double shrunk_mean(const Tally& part, double volume, double mean_of_cell, double shrink) const {
    const double expected = m_uniform ? part.count : m_total * volume;
    const double mean = expected > 0 ? part.sum / expected : 0;
    return (part.count * mean + shrink * mean_of_cell) / (part.count + shrink);
  }

  /// What a split gains. second_moment: the square root of the second moment of f / q over all leaves is the sum of
  /// sqrt(mean of f^2) * volume, so far as q is the best on these leaves; its decrease. mean: decrease of the
  /// Kullback-Leibler divergence of q from g, times the mean of g.
  double gain(double mean_a, double volume_a, double mean_b, double volume_b) const {
    const double volume = volume_a + volume_b, mass_a = mean_a * volume_a, mass_b = mean_b * volume_b;
    const double mean = (mass_a + mass_b) / volume;
    if (m_settings.target == KdTreeSettings::Target::second_moment)
      return std::sqrt(mean) * volume - std::sqrt(mean_a) * volume_a - std::sqrt(mean_b) * volume_b;
    const auto entropy = [](double mass, double density) { return mass > 0 ? mass * std::log(density) : 0; };
    return entropy(mass_a, mean_a) + entropy(mass_b, mean_b) - entropy(mass_a + mass_b, mean);
  }

  /// Sums of rows by bins of the cell, `bins` of them in each dimension from `first_dim` to `end_dim`.
  void tally_rows(const Box& box, Range range, int from, std::size_t first_dim, std::size_t end_dim, std::size_t bins,
                  std::vector<Tally>& tallies) const {
    std::array<float, KdTree::kMaxDims> scale;
    for (std::size_t d = first_dim; d < end_dim; ++d) scale[d] = static_cast<float>(bins) / (box.high[d] - box.low[d]);
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const float* y = &m_rows[from](i, 0);
      const double value = m_values[from][i];
      for (std::size_t d = first_dim; d < end_dim; ++d) {
        const auto bin = std::min(static_cast<std::size_t>((y[d] - box.low[d]) * scale[d]), bins - 1);
        tallies[(d - first_dim) * bins + bin] += {1, value, value * value};
      }
    }
  }

  Split best_split(const Cell& cell, const Box& box, Range range, int from, int depth) const {
    const bool cyclic = m_settings.split == KdTreeSettings::Split::cyclic;
    const std::size_t first_dim = cyclic ? static_cast<std::size_t>(depth) % m_dims : 0;
    const std::size_t end_dim = cyclic ? first_dim + 1 : m_dims;
    const std::size_t bins = cyclic ? 2 : kBins;
    std::vector<Tally> tallies((end_dim - first_dim) * bins);
    const std::size_t chunks = (range.size() + kChunk - 1) / kChunk;
    if (chunks > 1) {
      std::vector<std::vector<Tally>> parts(chunks, tallies);
      tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
        tally_rows(box, chunk(range, c), from, first_dim, end_dim, bins, parts[c]);
      });
      for (const auto& part : parts)
        for (std::size_t k = 0; k < tallies.size(); ++k) tallies[k] += part[k];
    } else {
      tally_rows(box, range, from, first_dim, end_dim, bins, tallies);
    }

    Tally whole;
    for (std::size_t b = 0; b < bins; ++b) whole += tallies[b];
    const double shrink = shrinking_samples(whole);
    Split best;
    for (std::size_t d = first_dim; d < end_dim; ++d) {
      const Tally* of_dim = &tallies[(d - first_dim) * bins];
      Tally all, lower;  // `all` in the order of `lower`, so that what is left of it is exact where no value is left
      for (std::size_t b = 0; b < bins; ++b) all += of_dim[b];
      for (std::size_t b = 1; b < bins; ++b) {
        lower += of_dim[b - 1];
        const Tally upper = all - lower;
        if (std::min(lower.count, upper.count) < m_settings.min_samples) continue;
        const double share = static_cast<double>(b) / static_cast<double>(bins);
        const auto at = static_cast<float>(box.low[d] + share * (static_cast<double>(box.high[d]) - box.low[d]));
        if (!(box.low[d] < at && at < box.high[d])) continue;
        const double volume_a = cell.volume * share, volume_b = cell.volume - volume_a;
        const double here = cyclic ? whole.sum
                                   : gain(shrunk_mean(lower, volume_a, cell.mean, shrink), volume_a,
                                          shrunk_mean(upper, volume_b, cell.mean, shrink), volume_b);
        if (here > best.gain) best = {here, static_cast<int>(d), at, lower, upper, shrink};
      }
    }
    return best;
  }

  static Range chunk(Range range, std::size_t c) {
    return {range.begin + c * kChunk, std::min(range.end, range.begin + (c + 1) * kChunk)};
  }

  /// Copies the rows below the split to the front of the other buffer's range and the rest behind, in their order;
  /// returns where the rest begins.
  std::size_t partition(Range range, int from, int dim, float split) {
    const int to = 1 - from;
    const auto d = static_cast<std::size_t>(dim);
    const std::size_t chunks = (range.size() + kChunk - 1) / kChunk;
    std::vector<std::size_t> lower(chunks + 1);  // rows below the split in the chunks before
    const auto count = [&](std::size_t c) {
      const Range rows = chunk(range, c);
      std::size_t n = 0;
      for (std::size_t i = rows.begin; i < rows.end; ++i) n += m_rows[from](i, d) < split;
      lower[c + 1] = n;
    };
    const auto scatter = [&](std::size_t c) {
      const Range rows = chunk(range, c);
      std::size_t next[2] = {range.begin + lower[c],
                             range.begin + lower[chunks] + (rows.begin - range.begin) - lower[c]};
      for (std::size_t i = rows.begin; i < rows.end; ++i) {
        const std::size_t at = next[!(m_rows[from](i, d) < split)]++;
        std::copy_n(&m_rows[from](i, 0), m_dims, &m_rows[to](at, 0));
        m_values[to][at] = m_values[from][i];
      }
    };
    const auto each_chunk = [&](const auto& work) {
      if (chunks == 1) return work(std::size_t{0});
      tbb::parallel_for(std::size_t{0}, chunks, work);
    };
    each_chunk(count);
    for (std::size_t c = 0; c < chunks; ++c) lower[c + 1] += lower[c];
    each_chunk(scatter);
    return range.begin + lower[chunks];
  }

  void grow(Cell& cell, const Box& box, Range range, int from, int depth) {
    if (range.size() < 2 * static_cast<std::size_t>(m_settings.min_samples) || depth >= kMaxDepth) return;
    const Split split = best_split(cell, box, range, from, depth);
    if (split.dim < 0) return;
    cell.gain = split.gain;
    cell.dim = split.dim;
    cell.split = split.at;
    cell.children = std::make_unique<std::array<Cell, 2>>();
    auto& [lower, upper] = *cell.children;
    const auto d = static_cast<std::size_t>(split.dim);
    Box lower_box = box, upper_box = box;
    lower_box.high[d] = upper_box.low[d] = split.at;
    lower.volume =
        cell.volume * (static_cast<double>(split.at) - box.low[d]) / (static_cast<double>(box.high[d]) - box.low[d]);
    upper.volume = cell.volume - lower.volume;
    lower.mean = shrunk_mean(split.lower, lower.volume, cell.mean, split.shrink);
    upper.mean = shrunk_mean(split.upper, upper.volume, cell.mean, split.shrink);
    const std::size_t middle = partition(range, from, split.dim, split.at);
    const auto grow_lower = [&] { grow(lower, lower_box, {range.begin, middle}, 1 - from, depth + 1); };
    const auto grow_upper = [&] { grow(upper, upper_box, {middle, range.end}, 1 - from, depth + 1); };
    if (range.size() < kSerial) {
      grow_lower();
      grow_upper();
    } else {
      tbb::parallel_invoke(grow_lower, grow_upper);
    }
  }

  const KdTreeSettings& m_settings;
  std::size_t m_dims;
  bool m_uniform;  // the examples were drawn uniformly
  double m_total;
  Matrix<float> m_rows[2];  // a cell's rows are in one of both, its children's in the other
  std::vector<float> m_values[2];
};

/// Uses the splits that gain most, until there are enough leaves.
void select_splits(Cell& root, int max_leaves) {
  const auto less = [](const Cell* a, const Cell* b) { return a->gain < b->gain; };
  std::priority_queue<Cell*, std::vector<Cell*>, decltype(less)> open(less);
  if (root.children) open.push(&root);
  for (int leaves = 1; leaves < max_leaves && !open.empty(); ++leaves) {
    Cell& cell = *open.top();
    open.pop();
    cell.is_split = true;
    for (Cell& child : *cell.children)
      if (child.children) open.push(&child);
  }
}

double density_of(const Cell& leaf, KdTreeSettings::Target target) {
  return target == KdTreeSettings::Target::second_moment ? std::sqrt(leaf.mean) : leaf.mean;
}

/// From here on `mean` is the mean density in a cell, unnormalised.
double set_density(Cell& cell, KdTreeSettings::Target target) {
  if (!cell.is_split) {
    cell.mean = density_of(cell, target);
  } else {
    auto& [lower, upper] = *cell.children;
    cell.mean = (set_density(lower, target) * lower.volume + set_density(upper, target) * upper.volume) / cell.volume;
  }
  return cell.mean;
}
void raise_to_floor(Cell& cell, double floor) {
  if (!cell.is_split) {
    cell.mean = std::max(cell.mean, floor);
  } else {
    auto& [lower, upper] = *cell.children;
    raise_to_floor(lower, floor);
    raise_to_floor(upper, floor);
    cell.mean = (lower.mean * lower.volume + upper.mean * upper.volume) / cell.volume;
  }
}

/// Breadth-first nodes, with the latent splits that give each side its mass.
KdTree::Nodes flatten(const Cell& root, std::size_t dims) {
  struct Entry {
    const Cell* cell;
    std::vector<float> z_low, z_high;
  };
  std::queue<Entry> queue;
  queue.push({&root, std::vector<float>(dims, 0.0f), std::vector<float>(dims, 1.0f)});
  KdTree::Nodes nodes;
  for (; !queue.empty(); queue.pop()) {
    const Entry& entry = queue.front();
    const Cell& cell = *entry.cell;
    if (cell.is_split) {
      const auto d = static_cast<std::size_t>(cell.dim);
      const auto& [lower, upper] = *cell.children;
      const double share = lower.mean * lower.volume / (cell.mean * cell.volume);
      const double low = entry.z_low[d], high = entry.z_high[d];
      const auto z_split = static_cast<float>(low + share * (high - low));
      // A side too unlikely for float32 is not cut off: the cell stays whole.
      if (entry.z_low[d] < z_split && z_split < entry.z_high[d]) {
        nodes.dim.push_back(static_cast<std::uint8_t>(d));
        nodes.y_split.push_back(cell.split);
        nodes.z_split.push_back(z_split);
        Entry below{&lower, entry.z_low, entry.z_high}, above{&upper, entry.z_low, entry.z_high};
        below.z_high[d] = above.z_low[d] = z_split;
        queue.push(std::move(below));
        queue.push(std::move(above));
        continue;
      }
    }
    nodes.dim.push_back(KdTree::Nodes::kLeaf);
    nodes.y_split.push_back(0);
    nodes.z_split.push_back(0);
  }
  return nodes;
}

}  // namespace

std::shared_ptr<const KdTree> fit_kdtree(Examples examples, const KdTreeSettings& settings) {
  const std::size_t dims = examples.y.cols();
  WARPATH_CHECK(dims >= 1 && dims <= KdTree::kMaxDims && examples.size() > 0);
  WARPATH_CHECK_EQ(examples.weight.size(), examples.size());
  if (settings.max_leaves < 1 || settings.max_leaves > (1 << 24))
    throw ConfigError(fmt::format("kd-tree: {} leaves at most, not 1 to {}", settings.max_leaves, 1 << 24));
  if (settings.min_samples < 1) throw ConfigError("kd-tree: a leaf needs at least 1 sample");
  if (!(settings.shrink >= 0)) throw ConfigError("kd-tree: shrink must not be negative");
  Cell root = Grower(std::move(examples), settings).grow();
  select_splits(root, settings.max_leaves);
  raise_to_floor(root, std::max(kFloor * set_density(root, settings.target), 1e-300));
  return std::make_shared<KdTree>(static_cast<int>(dims), flatten(root, dims));
}

}  // namespace warpath
