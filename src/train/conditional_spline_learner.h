#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "train/flow_optimiser.h"
#include "train/settings.h"
#include "train/vertex_learner.h"
#include "warp/conditional_spline.h"

namespace warpath {

/// Learns a ConditionalSpline from the vertices of passes, for those to come.
///
/// What is minimised is the variance of the estimate, E[f^2 / (p q)] over vertices that were drawn by p [MMRGN19],
/// where f is what came back over the brightness around that place of the film, so that dark places count as much as
/// bright ones; or, if the settings say so, -E[f / p ln q]. Examples are kept with a probability proportional to f / p
/// (importance resampling [TCE05]), since those to which nothing comes back teach nothing.
class ConditionalSplineLearner final : public VertexLearner {
 public:
  /// uniform: share of uniform numbers in the warp. Throws ConfigError for settings that make no sense.
  ConditionalSplineLearner(const ConditionalSplineSettings& settings, double uniform, std::uint64_t seed);
  ~ConditionalSplineLearner() override;

  std::unique_ptr<VertexRecorder> make_recorder() const override;
  void merge(VertexRecorder& recorder) override;
  std::shared_ptr<const VertexProposal> fit() override { return fit_flows(); }
  std::shared_ptr<const ConditionalSpline> fit_flows();

 private:
  class Recorder;
  struct Example;
  class Brightness;
  using Examples = std::vector<Example>;

  static bool survives(Example& example, double level);
  void thin(Examples& examples, double level) const;
  void train(std::size_t which, std::size_t visits);

  ConditionalSplineSettings m_settings;
  double m_uniform;
  std::shared_ptr<const ConditionalSpline::Shape> m_shape;
  std::optional<VertexBox> m_box;
  std::array<FlowOptimiser, 2> m_optimisers;  // of the numbers of light sampling, of scattering

  std::array<Examples, 2> m_examples;
  std::unique_ptr<Brightness> m_brightness;                // of all passes
  std::shared_ptr<const Brightness> m_brightness_of_pass;  // as it was before this pass: recorders use it
  double m_level = 0;                                      // an example of so much f / p is kept for sure
  double m_seen = 0, m_seen_before = 0;                    // vertices
};

}  // namespace warpath
