#pragma once
#include <memory>

#include "core/vertex_recorder.h"
#include "warp/vertex_warp.h"

namespace warpath {

/// Learns a warp of vertices from passes, for those to come.
class VertexTrainer : public VertexLearner {
 public:
  /// The warp after all passes so far.
  virtual std::shared_ptr<const VertexWarp> warp() = 0;
};

}  // namespace warpath
