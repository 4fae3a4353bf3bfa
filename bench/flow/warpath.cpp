// Whole flows on one thread: z -> y with its density, and a step of training, both for 2,048 samples; and drawing as
// the estimator does it, through the mixture with the uniform proposal.
//   bench_flow [--benchmark_filter=...]      peak_GFLOP/s = what a loop of nothing but FMAs reaches in the same run
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include "bench/flow/sizes.h"
#include "bench/nn/fma_peak.h"
#include "core/rng.h"
#include "train/flow_optimiser.h"
#include "warp/mixture.h"
#include "warp/realnvp.h"
#include "warp/spline.h"
#include "warp/uniform.h"

namespace {
using namespace warpath;

constexpr std::size_t kSamples = 2560;  // of a batch of the estimator

Matrix<double> uniform_rows(std::size_t cols) {
  Matrix<double> z(kSamples, cols);
  for (std::size_t i = 0; i < kSamples; ++i)
    for (std::uint32_t d = 0; d < cols; ++d) z(i, d) = sample_double(sample_key(1, i), d);
  return z;
}

void report(benchmark::State& state) {
  static const double peak = bench::fma_peak();
  state.counters["peak_GFLOP/s"] = peak * 1e-9;
  state.counters["samples"] = static_cast<double>(kSamples);
}

void forward(benchmark::State& state, const std::shared_ptr<const Warp>& warp) {
  const Matrix<double> z = uniform_rows(static_cast<std::size_t>(warp->dims()));
  Matrix<double> y(kSamples, z.cols());
  std::vector<double> log_det(kSamples);
  for (auto _ : state) {
    warp->forward(z.batch(), y.batch(), log_det);
    benchmark::ClobberMemory();
  }
  report(state);
}

void draw(benchmark::State& state, const std::shared_ptr<const Warp>& warp) {
  const auto uniform = std::make_shared<Uniform>(warp->dims());
  const Mixture mixture({{uniform, 0.1}, {warp, 0.9}});
  const Matrix<double> z = uniform_rows(static_cast<std::size_t>(warp->dims()));
  Matrix<double> u = uniform_rows(1);  // stratified, as the estimator has them where the film is warped
  for (std::size_t i = 0; i < kSamples; ++i) u(i, 0) = (static_cast<double>(i) + u(i, 0)) / kSamples;
  Matrix<double> y(kSamples, z.cols());
  std::vector<double> log_q(kSamples);
  for (auto _ : state) {
    mixture.sample(z.batch(), u.values(), y.batch(), log_q);
    benchmark::ClobberMemory();
  }
  report(state);
}

template <class Flow, class Settings>
void train(benchmark::State& state, const Flow& flow, const Settings& settings) {
  FlowOptimiser optimiser(flow, flow.initial(1), settings);
  ExampleBlocks batch;
  batch.resize(kSamples, static_cast<std::size_t>(flow.dims()));
  const Matrix<double> y = uniform_rows(batch.dims);
  for (std::size_t i = 0; i < kSamples; ++i) {
    std::vector<float> example;
    for (std::size_t d = 0; d < batch.dims; ++d) example.push_back(static_cast<float>(y(i, d)));
    batch.set(i, example, 1.0f / kSamples, 1.0f);
  }
  for (auto _ : state) benchmark::DoNotOptimize(optimiser.step(batch, 1e-9));
  report(state);
}

template <class FamilyWarp, class Sizes>
void add(const Sizes& sizes) {
  for (const auto& size : sizes) {
    const auto warp = FamilyWarp::untrained(size.dims, size.settings, 1);
    benchmark::RegisterBenchmark(("forward/" + size.name).c_str(), [warp](benchmark::State& s) { forward(s, warp); });
    benchmark::RegisterBenchmark(("draw/" + size.name).c_str(), [warp](benchmark::State& s) { draw(s, warp); });
    benchmark::RegisterBenchmark(("train/" + size.name).c_str(),
                                 [warp](benchmark::State& s) { train(s, warp->flow(), warp->settings()); });
  }
}

}  // namespace

int main(int count, char** arguments) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  add<Spline>(bench::spline_sizes());
  add<RealNvp>(bench::realnvp_sizes());
  benchmark::Initialize(&count, arguments);
  benchmark::RunSpecifiedBenchmarks();
}
