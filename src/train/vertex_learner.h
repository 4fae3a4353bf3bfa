#pragma once
#include <memory>

#include "path/vertex_recorder.h"
#include "warp/vertex_proposal.h"

namespace warpath {

/// Learns a warp of vertices from passes, for those to come.
class VertexLearner : public VertexObserver {
 public:
  /// Learns from the passes so far, and gives what the next ones are to be drawn with.
  virtual std::shared_ptr<const VertexProposal> fit() = 0;
};

}  // namespace warpath
