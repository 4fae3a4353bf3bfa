#pragma once
#include <tbb/parallel_for.h>

#include <cstddef>

#include "core/floating_point.h"

namespace warpath {

/// body(i) for i in [0, count), on all threads, one i at a time, denormals flushed.
void parallel(std::size_t count, const auto& body) {
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, count, 1),
      [&](const tbb::blocked_range<std::size_t>& range) {
        const FlushDenormals flush;
        for (std::size_t i = range.begin(); i != range.end(); ++i) body(i);
      },
      tbb::simple_partitioner());
}

}  // namespace warpath
