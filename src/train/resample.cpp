#include "train/resample.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "core/rng.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::size_t kBlock = 1 << 14;  // candidates that are summed in one go, whatever the number of threads

/// Calls each(block, first, end) for all blocks, in parallel.
template <class Each>
void for_each_block(std::size_t size, Each&& each) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, (size + kBlock - 1) / kBlock), [&](const auto& blocks) {
    for (std::size_t block = blocks.begin(); block != blocks.end(); ++block)
      each(block, block * kBlock, std::min(size, (block + 1) * kBlock));
  });
}

}  // namespace

Examples resample(const Candidates& candidates, std::uint64_t count, std::uint64_t seed, float most) {
  const auto target = [&](std::size_t i) { return std::min(candidates.target[i], most); };
  const std::size_t blocks = (candidates.size() + kBlock - 1) / kBlock;
  // starts[b] is the running sum before block b.
  std::vector<double> sums(blocks), starts(blocks + 1);
  for_each_block(candidates.size(), [&](std::size_t block, std::size_t first, std::size_t end) {
    double sum = 0;
    for (std::size_t i = first; i < end; ++i) sum += target(i);
    sums[block] = sum;
  });
  for (std::size_t block = 0; block < blocks; ++block) starts[block + 1] = starts[block] + sums[block];
  const double total = starts.back();
  if (!(total > 0)) return {};

  const auto dims = static_cast<std::size_t>(candidates.layout.dims());
  Examples examples{Matrix<float>(count, dims), std::vector<float>(count, 1.0f), std::vector<float>(count)};
  const double step = total / static_cast<double>(count);
  const double mean = total / static_cast<double>(candidates.size());
  const auto take = [&](std::size_t candidate, std::uint64_t k) {
    candidates.primary_sample(candidate, &examples.y(k, 0));
    examples.inv_q[k] = static_cast<float>(mean / static_cast<double>(target(candidate)));
  };
  const std::uint64_t stream = mix64(seed);
  const auto point = [&](std::uint64_t k) {
    return (static_cast<double>(k) + sample_double(sample_key(stream, k), 0)) * step;
  };
  // A block serves the points in [starts[b], starts[b + 1]); the last one also those that rounding has put behind.
  const auto first_point = [&](std::size_t block) -> std::uint64_t {
    if (block == 0) return 0;
    if (block == blocks) return count;
    auto k = static_cast<std::uint64_t>(std::max(0.0, starts[block] / step - 2));
    while (k < count && point(k) < starts[block]) ++k;
    return k;
  };
  for_each_block(candidates.size(), [&](std::size_t block, std::size_t first, std::size_t end) {
    std::uint64_t k = first_point(block);
    const std::uint64_t last = first_point(block + 1);
    if (k >= last) return;
    double sum = 0;
    std::size_t chosen = first;  // the last candidate with g > 0 takes what rounding leaves
    for (std::size_t i = first; i < end && k < last; ++i) {
      if (!(target(i) > 0)) continue;
      sum += target(i);
      chosen = i;
      for (; k < last && point(k) - starts[block] < sum; ++k) take(i, k);
    }
    for (; k < last; ++k) take(chosen, k);
  });
  return examples;
}

Examples weighted_examples(const Candidates& candidates, std::uint64_t first, std::uint64_t count) {
  WARPATH_CHECK(first + count <= candidates.size());
  Examples examples{
      Matrix<float>(count, static_cast<std::size_t>(candidates.layout.dims())), std::vector<float>(count), {}};
  for_each_block(count, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      candidates.primary_sample(first + i, &examples.y(i, 0));
      examples.weight[i] = candidates.target[first + i];
    }
  });
  return examples;
}

TargetMoments target_moments(const Candidates& candidates) {
  std::vector<TargetMoments> sums((candidates.size() + kBlock - 1) / kBlock);
  for_each_block(candidates.size(), [&](std::size_t block, std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) {
      const double g = candidates.target[i];
      sums[block].mean += g;
      sums[block].mean_square += g * g;
    }
  });
  TargetMoments moments;
  for (const TargetMoments& sum : sums) {
    moments.mean += sum.mean / static_cast<double>(candidates.size());
    moments.mean_square += sum.mean_square / static_cast<double>(candidates.size());
  }
  return moments;
}

}  // namespace warpath
