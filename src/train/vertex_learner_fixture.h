#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/rng.h"
#include "path/vertex.h"
#include "train/vertex_learner.h"

// Passes that teach a warp of vertices where light comes from: for the tests of its learners.
namespace warpath::test {

inline constexpr std::size_t kBatch = 4096;

/// Diffuse vertices on a floor, x and z in [0,1), seen from above: light comes from a quarter of the numbers that moves
/// with x.
struct Batch {
  explicit Batch(std::uint64_t seed) {
    for (std::size_t i = 0; i < kBatch; ++i) {
      const std::uint64_t key = sample_key(seed, i);
      const float x = sample_float(key, 10), z = sample_float(key, 11);
      Vertex vertex;
      vertex.position = {x, 0, z};
      vertex.normal[1] = 1;
      vertex.roughness = 1;
      vertex.film = {x, z};
      vertex.kind = static_cast<std::uint8_t>(SurfaceKind::diffuse);
      buffer.add(vertex);
      for (std::uint32_t d = 0; d < kBounceDimensions; ++d) numbers[d].push_back(sample_float(key, d));
      lanes.push_back(static_cast<std::uint32_t>(i));
      light.push_back(lit(x, numbers[1][i]) ? 1.0f : 0.0f);
      scatter_return.push_back(lit(x, numbers[4][i]) ? 100.0f : 0.0f);
    }
  }
  static bool lit(float x, float y) { return std::fabs(y - x) < 0.125f; }
  VertexRecords records(std::uint16_t bounce = 1) const {
    VertexRecords r;
    r.bounce = bounce;
    r.lanes = lanes;
    r.context = buffer.view();
    for (std::size_t d = 0; d < kBounceDimensions; ++d) r.numbers[d] = numbers[d].data();
    r.inv_q_light = r.inv_q_scatter = ones.data();
    r.light_return = light.data();
    r.scatter_return = scatter_return.data();
    return r;
  }
  VertexBuffer buffer;
  std::vector<std::uint32_t> lanes;
  std::array<std::vector<float>, kBounceDimensions> numbers;
  std::vector<float> light, scatter_return, ones = std::vector<float>(kBatch, 1.0f);
};

inline void teach(VertexLearner& learner, const Batch& batch, std::uint16_t bounce = 1) {
  const auto recorder = learner.make_recorder();
  recorder->record(batch.records(bounce));
  learner.merge(*recorder);
}

template <class Learner>
auto taught(Learner& learner, int passes, int batches = 8) {
  for (int p = 0; p < passes; ++p) {
    for (int b = 0; b < batches; ++b) teach(learner, Batch(static_cast<std::uint64_t>(p * batches + b)));
    if (p + 1 < passes) learner.fit();
  }
  return learner.fit();
}

/// Mean of ln q where light comes from, at vertices that nothing was learned from.
inline double gain(const VertexProposal& warp, VertexDecision which) {
  const Batch batch(999);
  std::vector<std::uint32_t> places(kBatch * warp.place_size());
  warp.locate(batch.buffer.view(), kBatch, places.data());
  const std::size_t first = which == VertexDecision::light_sampling ? 0 : 3;
  std::vector<float> inv_q(kBatch);
  warp.inverse_density(which, batch.buffer.view(), places.data(), kBatch,
                       {batch.numbers[first].data(), batch.numbers[first + 1].data(), batch.numbers[first + 2].data()},
                       inv_q.data());
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < kBatch; ++i) {
    if (!Batch::lit(batch.buffer.view().position[0][i], batch.numbers[first + 1][i])) continue;
    sum -= std::log(static_cast<double>(inv_q[i]));
    ++count;
  }
  return sum / count;
}

}  // namespace warpath::test
