// The kd-tree warp, 4D, 2^14 leaves: forward with density, and density alone, on one thread; beside a plain descent
// that takes one sample after the other through nodes linked by pointers, the way one would write it first.
//   bench_kdtree [--benchmark_filter=...]      over_plain = its time over ours, in the same run
#include <benchmark/benchmark.h>

#include <cmath>
#include <ctime>
#include <memory>

#include "core/rng.h"
#include "train/fit_kdtree.h"

namespace {
using namespace warpath;

constexpr std::size_t kDims = 4, kBatch = 2048, kExamples = 512'000;

Matrix<double> uniform_rows(std::size_t rows, std::uint64_t seed) {
  Matrix<double> z(rows, kDims);
  for (std::size_t i = 0; i < rows; ++i)
    for (std::uint32_t d = 0; d < kDims; ++d) z(i, d) = sample_double(sample_key(seed, i), d);
  return z;
}

/// Three narrow bumps along a diagonal over a faint ground.
Examples examples() {
  Examples result{Matrix<float>(kExamples, kDims), std::vector<float>(kExamples), {}};
  const Matrix<double> y = uniform_rows(kExamples, 1);
  for (std::size_t i = 0; i < kExamples; ++i) {
    double g = 0.02;
    for (const double centre : {0.2, 0.5, 0.8}) {
      double square = 0;
      for (std::size_t d = 0; d < kDims; ++d) {
        const double distance = y(i, d) - (d % 2 ? centre : 1 - centre);
        square += distance * distance;
        result.y(i, d) = static_cast<float>(y(i, d));
      }
      g += std::exp(-square / (2 * 0.08 * 0.08));
    }
    result.weight[i] = static_cast<float>(g);
  }
  return result;
}

KdTreeSettings settings() {
  KdTreeSettings settings;
  settings.min_samples = 16;  // so that 512 k examples fill 2^14 leaves
  settings.max_leaves = 1 << 14;
  return settings;
}

const KdTree& tree() {
  static const auto tree = fit_kdtree(examples(), settings());
  return *tree;
}

/// The same warp through nodes on the heap, rescaling z at each split.
struct PlainNode {
  std::size_t dim = 0;
  double split = 0, share = 0;
  std::unique_ptr<PlainNode> lower, upper;
};

std::unique_ptr<PlainNode> plain_tree() {
  const KdTree::Nodes& nodes = tree().nodes();
  auto root = std::make_unique<PlainNode>();
  struct Entry {
    PlainNode* node;
    std::vector<double> z_low, z_high;
  };
  std::vector<Entry> open{{root.get(), std::vector<double>(kDims, 0.0), std::vector<double>(kDims, 1.0)}};
  for (std::size_t i = 0; i < nodes.dim.size(); ++i) {
    if (nodes.dim[i] == KdTree::Nodes::kLeaf) continue;
    Entry entry = open[i];
    const std::size_t d = entry.node->dim = nodes.dim[i];
    entry.node->split = nodes.y_split[i];
    entry.node->share = (nodes.z_split[i] - entry.z_low[d]) / (entry.z_high[d] - entry.z_low[d]);
    entry.node->lower = std::make_unique<PlainNode>();
    entry.node->upper = std::make_unique<PlainNode>();
    Entry lower = entry, upper = entry;
    lower.node = entry.node->lower.get();
    upper.node = entry.node->upper.get();
    lower.z_high[d] = upper.z_low[d] = nodes.z_split[i];
    open.push_back(lower);
    open.push_back(upper);
  }
  return root;
}

void plain_forward(const PlainNode& root, const double* z_in, double* y, double& log_det) {
  double z[kDims], low[kDims], high[kDims], q = 1;
  std::copy_n(z_in, kDims, z);
  std::fill_n(low, kDims, 0.0);
  std::fill_n(high, kDims, 1.0);
  for (const PlainNode* node = &root; node->lower;) {
    const std::size_t d = node->dim;
    const double width = high[d] - low[d];
    if (z[d] < node->share) {
      z[d] /= node->share;
      q *= node->share * width / (node->split - low[d]);
      high[d] = node->split;
      node = node->lower.get();
    } else {
      z[d] = (z[d] - node->share) / (1 - node->share);
      q *= (1 - node->share) * width / (high[d] - node->split);
      low[d] = node->split;
      node = node->upper.get();
    }
  }
  for (std::size_t d = 0; d < kDims; ++d) y[d] = low[d] + z[d] * (high[d] - low[d]);
  log_det = -std::log(q);
}

/// CPU seconds of this thread: others may be using the machine.
double thread_seconds() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Seconds a sample of the plain descent.
double plain_seconds(Batch<const double> z) {
  static const auto root = plain_tree();
  Matrix<double> y(z.rows(), kDims);
  double log_det = 0;
  const double start = thread_seconds();
  for (std::size_t i = 0; i < z.rows(); ++i) {
    plain_forward(*root, &z(i, 0), &y(i, 0), log_det);
    benchmark::DoNotOptimize(log_det);
  }
  return (thread_seconds() - start) / static_cast<double>(z.rows());
}

template <class Work>
void run(benchmark::State& state, const Work& work) {
  const Matrix<double> z = uniform_rows(kBatch * 64, 2);
  Matrix<double> y(kBatch, kDims);
  std::vector<double> log_det(kBatch);
  plain_seconds(z.batch());  // builds both trees, and warms up
  const double plain = plain_seconds(z.batch()), start = thread_seconds();
  std::size_t next = 0;
  for (auto _ : state) {
    work(z.batch().rows_from(next * kBatch, kBatch), y.batch(), log_det);
    benchmark::ClobberMemory();
    next = (next + 1) % 64;
  }
  const double ours = (thread_seconds() - start) / static_cast<double>(state.iterations() * kBatch);
  state.counters["ns/sample"] = ours * 1e9;
  state.counters["over_plain"] = plain / ours;
  state.counters["leaves"] = static_cast<double>(tree().leaf_count());
}

void forward(benchmark::State& state) {
  run(state, [](Batch<const double> z, Batch<double> y, std::span<double> log_det) { tree().forward(z, y, log_det); });
}
void log_density(benchmark::State& state) {
  run(state, [](Batch<const double> z, Batch<double>, std::span<double> log_q) { tree().log_density(z, log_q); });
}

// From 512 k examples, all threads.
void build(benchmark::State& state) {
  const Examples source = examples();
  for (auto _ : state) {
    state.PauseTiming();
    Examples copy = source;
    state.ResumeTiming();
    benchmark::DoNotOptimize(fit_kdtree(std::move(copy), settings()));
  }
}

BENCHMARK(forward);
BENCHMARK(log_density);
BENCHMARK(build)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
