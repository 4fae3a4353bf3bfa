#pragma once
#include <cstddef>
#include <vector>

#include "nn/residual_net.h"
#include "nn/simd.h"

namespace warpath::realnvp {

/// Where the gradients of all parameters go: `slots` arrays, `stride` apart, that sum up to them.
struct GradientSlots {
  float* gradients;
  std::size_t slots, stride;
  GradientSlots from(std::size_t parameter) const { return {gradients + parameter, slots, stride}; }
};

/// One residual network with batch normalisation over a whole batch, a layer at a time, because each layer's statistics
/// need all samples (Ioffe and Szegedy 2015). It costs memory and barriers that the fused pass over blocks does not.
class BatchNormNet {
 public:
  /// `blocks` of kBlock samples, of which the first `examples` count.
  BatchNormNet(const nn::ResidualNet& net, std::size_t blocks, std::size_t examples);

  /// x: blocks x inputs x kBlock; out: block b's outputs x kBlock at out + b * out_stride. If `running` is given (the
  /// parameters again, to be written), its means and variances move towards the batch's.
  void forward(const float* parameters, const float* x, float* out, std::size_t out_stride, float* running);
  /// After forward with the same x: the gradients of all parameters; d_x: blocks x inputs x kBlock, added to what is
  /// there if `accumulate_x`, or null.
  void backward(const float* parameters, const float* x, const float* d_out, std::size_t out_stride,
                const GradientSlots& to, float* d_x, bool accumulate_x);

 private:
  std::size_t lanes(std::size_t block) const;  ///< samples of a block that count
  float* hidden(nn::AlignedVector<float>& layers, std::size_t layer, std::size_t block) const;
  float* rows(nn::AlignedVector<float>& blocks, std::size_t block) const { return blocks.data() + block * m_size; }
  const float* input(std::size_t layer, const float* x, std::size_t block);  ///< what a layer is given
  /// Mean and inverse deviation of the products of a layer, which are in m_standard; running statistics move.
  void gather_statistics(std::size_t layer, float* running);
  /// Standardises them, and makes m_active of them.
  void normalise(std::size_t layer, const float* parameters);
  /// Gradients of a layer's weights, each slot over its own blocks: of the output they are gradient_of(block), and then
  /// go to `then(block, gradient)`.
  template <class GradientOf, class Then>
  void weight_gradients(std::size_t layer, const float* x, const GradientSlots& to, const GradientOf& gradient_of,
                        const Then& then);
  /// Gradients of a layer's gain and bias, from m_g, the gradients of what follows the normalisation.
  void gain_gradients(std::size_t layer, float* gradients);
  /// From m_g to the gradients of what the layer normalises, in m_scratch.
  const float* through_normalisation(std::size_t layer, std::size_t block, const float* parameters,
                                     const float* gradients);
  /// From these to the gradients of what the layer was given: to m_g_next, or d_x.
  void through_weights(std::size_t layer, std::size_t block, const float* g, float* d_x, bool accumulate_x);

  const nn::ResidualNet& m_net;
  std::size_t m_blocks, m_examples, m_width, m_size;  ///< size: of a hidden layer of a block
  nn::AlignedVector<float> m_packed, m_back;
  nn::AlignedVector<float> m_standard, m_active;  ///< each hidden layer's (W x - mean) / deviation, and its output
  nn::AlignedVector<float> m_g, m_g_skip, m_g_next, m_scratch;
  nn::AlignedVector<float> m_transposed, m_no_bias;  ///< of each slot
  std::vector<float> m_mean;                         ///< of the layer's products
  std::vector<float> m_inverse_deviation;            ///< hidden layers x width
  std::vector<double> m_sums;                        ///< blocks x width x 2
};

}  // namespace warpath::realnvp
