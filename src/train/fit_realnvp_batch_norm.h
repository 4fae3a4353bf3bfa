#pragma once
#include <cstddef>
#include <vector>

#include "train/flow_optimiser.h"
#include "warp/realnvp_flow.h"

namespace warpath::realnvp {

/// One residual network with batch normalisation over a whole batch, a layer at a time, because each layer's statistics
/// need all samples (Ioffe and Szegedy 2015). It costs memory and barriers that the fused pass over blocks does not.
class BatchNormPass {
 public:
  /// `blocks` of kBlock samples, of which the first `examples` count.
  BatchNormPass(const nn::ResidualNet& net, std::size_t blocks, std::size_t examples);

  /// x: blocks x inputs x kBlock; out: block b's outputs x kBlock at out + b * out_stride. If `running` is given (the
  /// parameters again, to be written), its means and variances move towards the batch's.
  void forward(const float* parameters, const float* x, float* out, std::size_t out_stride, float* running);
  /// After forward with the same x: gradients of all parameters, in `slots` arrays `slot_stride` apart that sum up to
  /// them; d_x: blocks x inputs x kBlock, added to what is there if `accumulate_x`.
  void backward(const float* parameters, const float* x, const float* d_out, std::size_t out_stride, float* gradients,
                std::size_t slots, std::size_t slot_stride, float* d_x, bool accumulate_x);

 private:
  std::size_t lanes(std::size_t block) const;  ///< samples of a block that count
  float* hidden(nn::AlignedVector<float>& layers, std::size_t layer, std::size_t block) const;

  const nn::ResidualNet& m_net;
  std::size_t m_blocks, m_examples, m_size;
  nn::AlignedVector<float> m_packed, m_back;
  nn::AlignedVector<float> m_standard, m_active;  ///< each hidden layer's (W x - mean) / deviation, and its output
  nn::AlignedVector<float> m_g, m_g_skip, m_g_next, m_scratch;
  std::vector<float> m_inverse_deviation;  ///< hidden layers x width
  std::vector<double> m_sums;              ///< blocks x width x 2
};

/// The loss of Flow::train_block and its gradients over a whole batch, for flows with batch normalisation. Running
/// statistics in `parameters` are moved. gradients: `slots` arrays, parameter_count() apart, that sum up to them.
double batch_norm_step(const Flow& flow, const ExampleBlocks& batch, const FlowObjective& objective, float* parameters,
                       float* gradients, std::size_t slots);
/// The same as what an optimiser calls; the flow must outlive it.
FlowOptimiser::Pass batch_norm_pass(const Flow& flow);

}  // namespace warpath::realnvp
