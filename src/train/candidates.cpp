#include "train/candidates.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "core/floating_point.h"
#include "core/interrupt.h"
#include "core/math.h"
#include "core/rng.h"
#include "core/stopwatch.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::size_t kBatch = 2048;

/// Where one thread evaluates a batch.
struct Workspace {
  Workspace(std::size_t dims, std::size_t channels) : y(kBatch, dims), f(kBatch, channels), ids(kBatch) {}
  Matrix<double> y, f;
  std::vector<std::uint64_t> ids;
};

/// g of one contribution.
double target_of(std::span<const double> f) {
  if (f.size() == 3)
    return std::fabs(luminance(Color(static_cast<float>(f[0]), static_cast<float>(f[1]), static_cast<float>(f[2]))));
  double sum = 0;
  for (const double value : f) sum += std::fabs(value);
  return sum / static_cast<double>(f.size());
}

/// Evaluates count candidates from the one at `first` of those here; returns how many targets were not finite.
std::uint64_t evaluate_batch(const Integrand& integrand, Candidates& candidates, Workspace& workspace,
                             std::size_t first, std::size_t count) {
  const FlushDenormals flush;
  const auto dims = static_cast<std::size_t>(candidates.layout.dims());
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t id = kFirstCandidate + candidates.first + first + i;
    const std::uint64_t key = sample_key(candidates.seed, id);
    workspace.ids[i] = id;
    for (std::size_t d = 0; d < dims; ++d)
      workspace.y(i, d) = sample_float(key, candidates.layout.dimension(static_cast<int>(d)));
  }
  const Batch<double> f = workspace.f.batch().rows_from(0, count);
  integrand.evaluate(workspace.y.batch().rows_from(0, count), std::span(workspace.ids).first(count), f);
  std::uint64_t non_finite = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto target = static_cast<float>(target_of(f.row(i)));
    const bool finite = std::isfinite(target);
    candidates.target[first + i] = finite ? target : 0.0f;
    non_finite += !finite;
  }
  if (!candidates.contribution.empty())
    for (std::size_t i = 0; i < count; ++i)
      std::copy(f.row(i).begin(), f.row(i).end(),
                candidates.contribution.begin() + static_cast<std::ptrdiff_t>((first + i) * f.cols()));
  return non_finite;
}

}  // namespace

void Candidates::primary_sample(std::uint64_t i, float* y) const {
  const std::uint64_t key = sample_key(seed, kFirstCandidate + first + i);
  for (int d = 0; d < layout.dims(); ++d) y[d] = sample_float(key, layout.dimension(d));
}

Candidates gather_candidates(const Integrand& integrand, const Layout& layout, std::uint64_t seed, std::uint64_t count,
                             const CandidateProgress& progress, bool keep_contributions, std::uint64_t first_id) {
  WARPATH_CHECK_EQ(integrand.dims(), layout.dims());
  const Stopwatch clock;
  Candidates candidates;
  candidates.layout = layout;
  candidates.seed = seed;
  candidates.first = first_id;
  candidates.target.resize(count);
  if (keep_contributions) candidates.contribution.resize(count * static_cast<std::size_t>(integrand.channels()));
  tbb::enumerable_thread_specific<Workspace> workspaces(static_cast<std::size_t>(integrand.dims()),
                                                        static_cast<std::size_t>(integrand.channels()));
  std::mutex mutex;
  std::uint64_t done = 0;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, (count + kBatch - 1) / kBatch, 1), [&](const auto& batches) {
    for (std::size_t batch = batches.begin(); batch != batches.end() && !g_interrupted; ++batch) {
      const std::size_t first = batch * kBatch, size = std::min(kBatch, count - first);
      const std::uint64_t non_finite = evaluate_batch(integrand, candidates, workspaces.local(), first, size);
      const std::lock_guard lock(mutex);
      candidates.non_finite += non_finite;
      done += size;
      if (progress) progress(done);
    }
  });
  if (done < count) throw Interrupted();
  candidates.seconds = clock.wall();
  candidates.cpu_seconds = clock.cpu();
  return candidates;
}

}  // namespace warpath
