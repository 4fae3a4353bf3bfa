#include "integrand/path_integrand.h"

#include <algorithm>

#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::size_t kBatch = 2048;  // what a thread's workspace should hold at once

}  // namespace

PathIntegrand::PathIntegrand(std::shared_ptr<const Tracer> tracer, Layout layout, std::uint64_t seed)
    : m_tracer(std::move(tracer)), m_layout(std::move(layout)), m_seed(seed) {}

void PathIntegrand::evaluate(Batch<const double> y, std::span<const std::uint64_t> ids, Batch<double> f) const {
  WARPATH_CHECK_EQ(y.rows(), ids.size());
  WARPATH_CHECK_EQ(f.rows(), ids.size());
  WARPATH_CHECK_EQ(static_cast<int>(y.cols()), dims());
  WARPATH_CHECK_EQ(static_cast<int>(f.cols()), channels());
  thread_local PathResults results;
  for (std::size_t first = 0; first < ids.size(); first += kBatch) {
    const std::size_t n = std::min(kBatch, ids.size() - first);
    FixedSource source(m_seed, ids.subspan(first, n), m_layout, y.data() + first * y.stride(), y.stride());
    m_tracer->trace(source, n, results);
    for (std::size_t i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) f(first + i, c) = results.radiance[i][c];
  }
}

}  // namespace warpath
