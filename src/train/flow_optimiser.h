#pragma once
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "nn/adam.h"
#include "warp/coupling_flow.h"

namespace warpath {

/// Weighted examples as blocks of dims x nn::kBlock doubles; what is left of the last block weighs nothing.
struct ExampleBlocks {
  std::size_t examples = 0, count = 0, dims = 0, context_rows = 0;  ///< count: of blocks
  nn::AlignedVector<double> y;
  nn::AlignedVector<float> weight, target;  ///< target: g, in units of its mean over all candidates
  nn::AlignedVector<float> context;         ///< what the flow is conditioned on: count x context_rows x kBlock

  void resize(std::size_t examples_, std::size_t dims_, std::size_t context_rows_ = 0);
  void set(std::size_t i, std::span<const float> example, float w, float g);
  const double* block_y(std::size_t b) const { return y.data() + b * dims * nn::kBlock; }
  const float* block_context(std::size_t b) const { return context.data() + b * context_rows * nn::kBlock; }
  float* block_context(std::size_t b) { return context.data() + b * context_rows * nn::kBlock; }
  const float* block_weight(std::size_t b) const { return weight.data() + b * nn::kBlock; }
  const float* block_target(std::size_t b) const { return target.data() + b * nn::kBlock; }
};

/// Parameters of a flow on their way down the gradient. All sums have a fixed order: threads change no bit.
class FlowOptimiser {
 public:
  /// The loss over a whole batch and its gradients of the packed weights, in `slots` arrays, parameter_count() apart,
  /// that sum up to them; may move parameters that no gradient reaches.
  using Pass = std::function<double(const ExampleBlocks& batch, const FlowObjective& objective, float* parameters,
                                    float* gradients, std::size_t slots)>;

  /// Without `pass`, CouplingFlow::train_block makes the gradients, a block at a time.
  FlowOptimiser(const CouplingFlow& flow, nn::AlignedVector<float> parameters, const FlowTraining& settings,
                Pass pass = {});

  /// One step of Adam on the loss that the settings name; weights must sum up to 1. Returns the loss before it,
  /// ln E[g / q] for Loss::variance.
  double step(const ExampleBlocks& batch, double rate);

  const nn::AlignedVector<float>& parameters() const { return m_parameters; }
  const nn::AlignedVector<float>& averaged() const { return m_average; }
  int steps() const { return m_step; }

 private:
  /// Gradients by train_block, each slot's blocks in turn; returns the loss.
  double fused_pass(const ExampleBlocks& batch, std::size_t slots);
  void update(std::size_t coupling, std::size_t slots, const nn::Adam& adam);

  const CouplingFlow& m_flow;
  FlowTraining m_settings;
  Pass m_pass;
  int m_step = 0;
  FlowObjective m_objective;
  nn::AlignedVector<float> m_parameters, m_average, m_gradients, m_m, m_v;
  PackedParameters m_packed;
  std::vector<nn::AlignedVector<float>> m_scratch;  ///< one for each slot
};

}  // namespace warpath
