#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "path/primary_source.h"

namespace warpath {

/// All vertices of one bounce of a finished batch: the training data of conditional warps. Entry i belongs to the path
/// lanes[i]. Arrays live until record() returns.
struct VertexRecords {
  std::uint16_t bounce = 0;
  std::span<const std::uint32_t> lanes;
  VertexContext context;
  /// light, light_uv x 2, lobe, dir x 2, rr: the numbers that were handed out
  std::array<const float*, kBounceDimensions> numbers{};
  const float* inv_q_light = nullptr;    ///< product over light and light_uv
  const float* inv_q_scatter = nullptr;  ///< product over lobe and dir
  /// Luminance that the light-sampling term added, divided by the throughput (with inv_q) of the path before the
  /// vertex, including inv_q_light.
  const float* light_return = nullptr;
  /// Luminance that came back through the sampled direction, from all that is beyond, divided likewise, including
  /// inv_q_scatter.
  const float* scatter_return = nullptr;
};

/// Attached to a trace, it is shown every vertex when the batch is done, bounce by bounce.
class VertexRecorder {
 public:
  virtual ~VertexRecorder() = default;
  virtual void record(const VertexRecords& records) = 0;
};

/// Learns from the vertices of a pass. Every batch is recorded by a recorder of its own, and recorders are merged one
/// at a time, in the order of the batches, so that what is learned does not depend on the number of threads.
class VertexObserver {
 public:
  virtual ~VertexObserver() = default;
  virtual std::unique_ptr<VertexRecorder> make_recorder() const = 0;
  /// Takes what one batch left in a recorder that make_recorder() made, and empties it.
  virtual void merge(VertexRecorder& recorder) = 0;
};

}  // namespace warpath
