#pragma once
#include <cstdint>

namespace warpath::bench {
/// FLOP/s of one thread in a loop of independent float32 FMAs on the best instruction set; measured anew by each call
/// (some milliseconds), because clocks move.
double fma_peak();
/// That loop, 12 vectors of FMAs a round; returns the number of floating-point operations.
double fma_loop(std::int64_t rounds);
}  // namespace warpath::bench
