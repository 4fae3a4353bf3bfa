#include "bench/nn/fma_peak.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/nn/fma_peak.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace warpath::bench::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Returns the number of floating-point operations; 12 chains hide the latency of two units.
double Chains(std::int64_t rounds, float* out) {
  using D = hn::CappedTag<float, 16>;
  const D d;
  constexpr int kChains = 12;
  hn::Vec<D> acc[kChains];
  for (int i = 0; i < kChains; ++i) acc[i] = hn::Set(d, static_cast<float>(i));
  const auto a = hn::Set(d, 0.999f), b = hn::Set(d, 0.001f);
  for (std::int64_t round = 0; round < rounds; ++round) {
    HWY_UNROLL(12)
    for (int i = 0; i < kChains; ++i) acc[i] = hn::MulAdd(acc[i], a, b);
  }
  for (int i = 1; i < kChains; ++i) acc[0] = hn::Add(acc[0], acc[i]);
  *out = hn::GetLane(hn::SumOfLanes(d, acc[0]));
  return 2.0 * kChains * static_cast<double>(hn::Lanes(d)) * static_cast<double>(rounds);
}

}  // namespace warpath::bench::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace warpath::bench {
HWY_EXPORT(Chains);

double fma_loop(std::int64_t rounds) {
  static std::atomic<float> sink;  // so that the loop is not taken out
  float out;
  const double flops = HWY_DYNAMIC_DISPATCH(Chains)(rounds, &out);
  sink = out;
  return flops;
}

double fma_peak() {
  using Clock = std::chrono::steady_clock;
  double best = 0;
  for (int i = 0; i < 10; ++i) {
    const auto start = Clock::now();
    const double flops = fma_loop(500'000);
    best = std::max(best, flops / std::chrono::duration<double>(Clock::now() - start).count());
  }
  return best;
}

}  // namespace warpath::bench
#endif  // HWY_ONCE
