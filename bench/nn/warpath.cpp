// The networks' kernels against the machine's own limit: what a loop of nothing but FMAs reaches in the same run.
//   bench_nn [--benchmark_filter=...]      peak = share of that limit; one thread
#include <benchmark/benchmark.h>

#include <algorithm>

#include "bench/nn/fma_peak.h"
#include "nn/adam.h"
#include "nn/dense.h"
#include "nn/residual_net.h"

namespace {
using namespace warpath;
using namespace warpath::nn;

struct Net {
  explicit Net(int width, Products products = fastest_products())
      : net(width, width, 2, width, Norm::none, products), parameters(net.parameter_count()) {
    net.initialise(parameters.data(), 1, 1);
    gradients = m = v = parameters;
    std::fill(m.begin(), m.end(), 0.0f);
    std::fill(v.begin(), v.end(), 0.0f);
    packed.resize(net.packed_count());
    back.resize(net.packed_back_count());
    net.pack(parameters.data(), packed.data());
    x.assign(static_cast<std::size_t>(width * kBlock), 0.5f);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = static_cast<float>(i * 2654435761u % 1000) * 1e-3f;
    d_x = out = x;
    scratch.resize(net.scratch_count());
    activations.resize(net.activation_count());
  }
  ResidualNet net;
  AlignedVector<float> parameters, gradients, m, v, packed, back, x, d_x, out, scratch, activations;
};

void report(benchmark::State& state, double flops) {
  const double peak = bench::fma_peak();
  state.counters["GFLOP/s"] = benchmark::Counter(flops * 1e-9, benchmark::Counter::kIsIterationInvariantRate);
  state.counters["peak_GFLOP/s"] = peak * 1e-9;
  state.counters["of_peak"] = benchmark::Counter(flops / peak, benchmark::Counter::kIsIterationInvariantRate);
}

void forward(benchmark::State& state) {
  Net n(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    n.net.infer(n.packed.data(), n.x.data(), n.scratch.data(), n.out.data());
    benchmark::ClobberMemory();
  }
  report(state, 2.0 * kBlock * static_cast<double>(n.net.multiply_adds()));
}

// A step of 32 blocks (2,048 samples): forward, backward, Adam, packing.
void train(benchmark::State& state, Products products) {
  Net n(static_cast<int>(state.range(0)), products);
  constexpr int blocks = 32;
  int step = 0;
  n.net.pack_for_training(n.parameters.data(), n.packed.data(), n.back.data());
  for (auto _ : state) {
    for (int b = 0; b < blocks; ++b) {
      std::copy(n.x.begin(), n.x.end(), n.activations.begin());
      n.net.forward(n.packed.data(), n.activations.data(), n.out.data());
      n.net.backward(n.back.data(), n.activations.data(), n.out.data(), n.gradients.data(), b > 0, n.d_x.data(), false,
                     n.scratch.data());
    }
    adam_step(Adam{.rate = 1e-9f}, ++step, n.net.parameter_count(), n.gradients.data(), n.parameters.data(), n.m.data(),
              n.v.data());
    n.net.pack_for_training(n.parameters.data(), n.packed.data(), n.back.data());
    benchmark::ClobberMemory();
  }
  report(state, 6.0 * kBlock * blocks * static_cast<double>(n.net.multiply_adds()));
}

BENCHMARK(forward)->Arg(32)->Arg(64)->Arg(128);
BENCHMARK_CAPTURE(train, floats, Products::floats)->Arg(32)->Arg(64)->Arg(128);
BENCHMARK_CAPTURE(train, fastest, fastest_products())->Arg(32)->Arg(64)->Arg(128);

}  // namespace

BENCHMARK_MAIN();
