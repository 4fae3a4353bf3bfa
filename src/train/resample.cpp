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

void ResampledExamples::primary_sample(std::size_t i, float* y) const {
  const std::uint64_t key = sample_key(m_seed, kFirstCandidate + m_ids[i]);
  for (int d = 0; d < m_layout.dims(); ++d) y[d] = sample_float(key, m_layout.dimension(d));
}

Resampler::Resampler(Layout layout, std::uint64_t candidates, std::uint64_t count, std::uint64_t seed)
    : m_candidates(candidates), m_count(count), m_stream(mix64(seed)) {
  m_examples.m_layout = std::move(layout);
}

double Resampler::point(std::uint64_t k) const {
  return (static_cast<double>(k) + sample_double(sample_key(m_stream, k), 0)) * m_step;
}

std::uint64_t Resampler::first_point_from(double sum) const {
  auto k = static_cast<std::uint64_t>(std::max(0.0, sum / m_step - 2));
  while (point(k) < sum) ++k;
  return k;
}

void Resampler::add(const Candidates& chunk, float most) {
  WARPATH_CHECK_EQ(chunk.first, m_seen);
  const auto target = [&](std::size_t i) { return std::min(chunk.target[i], most); };
  const std::size_t blocks = (chunk.size() + kBlock - 1) / kBlock;
  // starts[b] is the running sum before block b.
  std::vector<double> sums(blocks), starts(blocks + 1, m_sum);
  for_each_block(chunk.size(), [&](std::size_t block, std::size_t first, std::size_t end) {
    double sum = 0;
    for (std::size_t i = first; i < end; ++i) sum += target(i);
    sums[block] = sum;
  });
  for (std::size_t block = 0; block < blocks; ++block) starts[block + 1] = starts[block] + sums[block];
  m_seen += chunk.size();
  m_sum = starts.back();
  if (!(m_sum > starts.front())) return;
  if (m_step == 0) {
    const double more = static_cast<double>(m_candidates) / static_cast<double>(m_seen);
    m_step = m_sum * more / static_cast<double>(m_count);
    m_examples.m_seed = chunk.seed;
  }

  const double mean = m_step * static_cast<double>(m_count) / static_cast<double>(m_candidates);
  const bool one_piece = chunk.size() == m_candidates;
  const std::uint64_t begin = m_examples.size();
  const std::uint64_t end = one_piece ? m_count : first_point_from(m_sum);
  // One allocation for all, so that memory does not double while they grow.
  m_examples.m_ids.reserve(m_count + m_count / 8);
  m_examples.m_target.reserve(m_count + m_count / 8);
  m_examples.m_ids.resize(end);
  m_examples.m_target.resize(end);
  const auto take = [&](std::size_t i, std::uint64_t k) {
    m_examples.m_ids[k] = chunk.first + i;
    m_examples.m_target[k] = 1 / static_cast<float>(mean / static_cast<double>(target(i)));
  };
  // A block serves the points in [starts[b], starts[b + 1]); the last one also those that rounding has put behind.
  const auto first_point = [&](std::size_t block) {
    if (block == 0) return begin;
    if (block == blocks) return end;
    return std::clamp(first_point_from(starts[block]), begin, end);
  };
  for_each_block(chunk.size(), [&](std::size_t block, std::size_t first, std::size_t last) {
    std::uint64_t k = first_point(block);
    const std::uint64_t behind = first_point(block + 1);
    if (k >= behind) return;
    double sum = 0;              // since the block's start
    std::size_t chosen = first;  // the last candidate with g > 0 takes what rounding leaves
    for (std::size_t i = first; i < last && k < behind; ++i) {
      if (!(target(i) > 0)) continue;
      sum += target(i);
      chosen = i;
      for (; k < behind && point(k) - starts[block] < sum; ++k) take(i, k);
    }
    for (; k < behind; ++k) take(chosen, k);
  });
}

ResampledExamples resample(const Candidates& candidates, std::uint64_t count, std::uint64_t seed, float most) {
  Resampler resampler(candidates.layout, candidates.size(), count, seed);
  resampler.add(candidates, most);
  return std::move(resampler).take();
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
