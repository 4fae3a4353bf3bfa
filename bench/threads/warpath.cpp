// How much faster two threads are than one: nothing but FMAs, a step of training, and drawing warped samples.
//   bench_threads      one line of JSON: seconds of one and of two threads, the best of each, run by turns
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <limits>

#include "bench/flow/sizes.h"
#include "bench/nn/fma_peak.h"
#include "core/parallel.h"
#include "core/rng.h"
#include "train/flow_optimiser.h"
#include "warp/spline.h"

namespace {
using namespace warpath;

std::array<double, 2> best_seconds(const std::function<void()>& work) {
  using Clock = std::chrono::steady_clock;
  std::array<double, 2> best;
  best.fill(std::numeric_limits<double>::infinity());
  for (int i = 0; i < 6; ++i)
    for (std::size_t t = 0; t < 2; ++t) {
      const tbb::global_control control(tbb::global_control::max_allowed_parallelism, t + 1);
      const auto start = Clock::now();
      work();
      best[t] = std::min(best[t], std::chrono::duration<double>(Clock::now() - start).count());
    }
  return best;
}

}  // namespace

int main() {
  constexpr std::size_t kBatch = 2048, kBatches = 512;
  const auto size = bench::spline_size(4, 64, 16, 4);
  const auto warp = Spline::untrained(size.dims, size.settings, 1);
  const auto dims = static_cast<std::size_t>(size.dims);

  const auto fma = [] { parallel(16, [](std::size_t) { bench::fma_loop(4'000'000); }); };
  Matrix<double> z(kBatch, dims);
  for (std::size_t i = 0; i < kBatch; ++i)
    for (std::uint32_t d = 0; d < dims; ++d) z(i, d) = sample_double(sample_key(1, i), d);
  const auto warping = [&] {
    parallel(kBatches, [&](std::size_t) {
      Matrix<double> y(kBatch, dims);
      std::vector<double> log_q(kBatch);
      warp->sample(z.batch(), {}, y.batch(), log_q);
    });
  };
  ExampleBlocks batch;
  batch.resize(kBatch, dims);
  for (std::size_t i = 0; i < kBatch; ++i) {
    std::vector<float> example;
    for (std::size_t d = 0; d < dims; ++d) example.push_back(static_cast<float>(z(i, d)));
    batch.set(i, example, 1.0f / kBatch, 1.0f);
  }
  const auto training = [&] {
    FlowOptimiser optimiser(warp->flow(), warp->flow().initial(1), size.settings);
    for (int i = 0; i < 200; ++i) optimiser.step(batch, 1e-3);
  };

  std::string line;
  for (const auto& [name, work] :
       {std::pair<const char*, std::function<void()>>{"fma", fma}, {"training", training}, {"warping", warping}}) {
    const auto [one, two] = best_seconds(work);
    line += fmt::format("{}\"{}\": [{}, {}]", line.empty() ? "" : ", ", name, one, two);
  }
  fmt::print("{{{}}}\n", line);
}
