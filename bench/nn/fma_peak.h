#pragma once

namespace warpath::bench {
/// FLOP/s of one thread in a loop of independent float32 FMAs on the best instruction set; measured anew by each call
/// (some milliseconds), because clocks move.
double fma_peak();
}  // namespace warpath::bench
