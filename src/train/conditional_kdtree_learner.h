#pragma once
#include <array>
#include <memory>
#include <vector>

#include "train/settings.h"
#include "train/vertex_learner.h"
#include "warp/conditional_kdtree.h"

namespace warpath {

/// Learns a ConditionalKdTree from the vertices of passes, for those to come: after each pass every tile's tree is
/// grown anew (fit_kdtree) from all that was seen there, or, if that is too much, from as much of it as is kept, drawn
/// evenly.
class ConditionalKdTreeLearner final : public VertexLearner {
 public:
  /// width, height: pixels of the film. uniform: share of uniform numbers in the warp. Throws ConfigError for settings
  /// that make no sense.
  ConditionalKdTreeLearner(const ConditionalKdTreeSettings& settings, int width, int height, double uniform);

  std::unique_ptr<VertexRecorder> make_recorder() const override;
  void merge(VertexRecorder& recorder) override;
  std::shared_ptr<const VertexProposal> fit() override { return fit_trees(); }
  std::shared_ptr<const ConditionalKdTree> fit_trees();

 private:
  class Recorder;
  /// Numbers that were drawn at a vertex.
  struct Example {
    std::array<float, 2> film;
    std::array<float, 3> y;
    float weight;  ///< what came back, over the throughput and with 1 / q; 0 if it was not finite
    float inv_q;
    float order;  ///< in [0,1): those below a threshold are kept
  };
  using Examples = std::vector<Example>;

  ConditionalKdTree::Trees grow(const Examples& examples) const;

  ConditionalKdTreeSettings m_settings;
  FilmTiling m_tiling;
  double m_uniform;
  std::array<Examples, 2> m_examples;  // of light sampling, of scattering
  double m_seen = 0;                   // vertices of all passes
  float m_kept = 1;                    // examples of a lesser order are kept
};

}  // namespace warpath
