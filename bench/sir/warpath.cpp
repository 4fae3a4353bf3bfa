// Resampling 4 M candidates into 512 k examples, all threads; beside the machine's own limit, copying the bytes that
// are read and written, and beside std::discrete_distribution, the standard library's way to draw with given weights.
//   bench_sir      over_copy = our time over that of the copy; over_std = its time over ours; both in the same run
#include <benchmark/benchmark.h>

#include <chrono>
#include <cstring>
#include <random>

#include "core/rng.h"
#include "train/resample.h"

namespace {
using namespace warpath;

constexpr std::uint64_t kCandidates = 4'000'000, kExamples = 512'000;

Candidates candidates() {
  Candidates result;
  result.layout = Layout::parse("film+bounce1");
  result.target.resize(kCandidates);
  for (std::uint64_t i = 0; i < kCandidates; ++i) {
    const float u = sample_float(sample_key(1, i), 0);
    result.target[i] = u < 0.3f ? 0 : 1 / (1.0001f - u);  // a third dark, a few very bright
  }
  return result;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double copy_seconds(const Candidates& candidates) {
  std::vector<char> from(kCandidates * 4 + kExamples * 20, 1), to(from.size(), 2);
  std::memcpy(from.data(), candidates.target.data(), kCandidates * 4);
  const auto start = std::chrono::steady_clock::now();
  std::memcpy(to.data(), from.data(), from.size());
  benchmark::DoNotOptimize(to.data());
  return seconds_since(start);
}

double std_seconds(const Candidates& candidates) {
  const auto start = std::chrono::steady_clock::now();
  std::mt19937_64 engine(1);
  std::discrete_distribution<std::uint64_t> distribution(candidates.target.begin(), candidates.target.end());
  Matrix<float> y(kExamples, 4);
  for (std::uint64_t k = 0; k < kExamples; ++k) candidates.primary_sample(distribution(engine), &y(k, 0));
  benchmark::DoNotOptimize(y.values().data());
  return seconds_since(start);
}

void sir(benchmark::State& state) {
  const Candidates source = candidates();
  const double copy = copy_seconds(source), standard = std_seconds(source);
  const auto start = std::chrono::steady_clock::now();
  std::uint64_t seed = 0;
  for (auto _ : state) benchmark::DoNotOptimize(resample(source, kExamples, ++seed));
  const double ours = seconds_since(start) / static_cast<double>(state.iterations());
  state.counters["over_copy"] = ours / copy;
  state.counters["over_std"] = standard / ours;
}
BENCHMARK(sir)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
