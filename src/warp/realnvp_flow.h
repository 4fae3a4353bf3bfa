#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "nn/residual_net.h"
#include "warpath/train.h"

namespace warpath::realnvp {

/// One affine coupling: the networks see the kept dimensions and say how the moved ones are scaled and shifted.
struct Coupling {
  std::vector<int> kept, moved;
  std::vector<nn::ResidualNet> nets;  ///< s and t; or one with the outputs of both, s first
  // Place of each net's numbers in the flow's arrays, and of the scales a, one for each moved dimension.
  std::vector<std::size_t> parameters, packed, packed_back, activations;
  std::size_t scales = 0;
};

/// A tensor of the parameters: rows x cols, rows `stride` apart, from `offset` on.
struct ParameterView {
  std::string name;  ///< `coupling0.s.layer1.weight`, `coupling0.scale`, ...
  std::size_t offset, rows, cols, stride;
};

/// Parameters as the kernels want them.
struct Packed {
  nn::AlignedVector<float> forward, back, scales;
};

/// What a step of training minimises, see RealNvpSettings::Loss.
struct Objective {
  RealNvpSettings::Loss loss = RealNvpSettings::Loss::likelihood;
  double uniform = 0;  ///< variance only: q stands for (1 - uniform) q + uniform
  double scale = 1;    ///< variance only: about E[g / q]; the gradient is that of the loss over it
};

/// One example weighs no more in the gradient of the variance than so many average ones: rare bright paths would throw
/// the weights about.
inline constexpr double kMostWeight = 10;

/// The loss summed over one block: of weight[i] * -ln q_i, or of weight[i] * target[i] / q_i, each example's part of it
/// cut off at kMostWeight * scale. d_log_q: its derivative with respect to -ln q_i (divided by scale).
double block_loss(const Objective& objective, const double* log_q, const float* weight, const float* target,
                  float* d_log_q);

/// The stack of couplings as arithmetic over blocks of nn::kBlock samples; it holds shapes, no parameters.
class Flow {
 public:
  /// Throws ConfigError for settings that make no flow.
  Flow(int dims, const RealNvpSettings& settings);

  int dims() const { return m_dims; }
  const RealNvpSettings& settings() const { return m_settings; }
  const std::vector<Coupling>& couplings() const { return m_couplings; }
  std::size_t parameter_count() const { return m_parameters; }  ///< padding included; a multiple of 16
  std::vector<ParameterView> views() const;
  std::size_t multiply_adds() const;  ///< of the networks, for one sample forward

  /// Parameters of the identity: every s is 0 because its scale is, every t because its last layer is.
  nn::AlignedVector<float> initial(std::uint64_t seed) const;

  /// Sizes `packed`, without transposes unless `back`; then pack_coupling fills it, one coupling at a time.
  void resize(Packed& packed, bool back) const;
  void pack_coupling(std::size_t coupling, const float* parameters, Packed& packed) const;
  void pack(const float* parameters, Packed& packed, bool back) const;

  /// Floats of scratch that forward and inverse need.
  std::size_t scratch_count() const;
  /// z -> y and ln|det dy/dz|, rows of kBlock doubles: z, y: dims x kBlock (y may be z), log_det: kBlock; all aligned.
  void forward(const Packed& packed, const double* z, double* y, double* log_det, float* scratch) const;
  /// y -> z and ln|det dz/dy|.
  void inverse(const Packed& packed, const double* y, double* z, double* log_det, float* scratch) const;

  /// Floats of scratch that train_block needs.
  std::size_t training_scratch_count() const;
  /// The loss over one block, see block_loss, and its gradient. y: dims x kBlock doubles; weight: kBlock, 0 for samples
  /// that only fill the block; target: kBlock, g of each, may be null with Loss::likelihood. gradients:
  /// parameter_count(), layout as the parameters, gains folded in (see ResidualNet::unfold), padding between tensors
  /// untouched; it is added to what is there if `accumulate`.
  double train_block(const Packed& packed, const double* y, const float* weight, const float* target,
                     const Objective& objective, float* gradients, bool accumulate, float* scratch) const;

  /// What a coupling's networks see: v (dims x kBlock) -> x (inputs x kBlock).
  void encode_kept(const Coupling& coupling, const float* v, float* x) const;
  /// d_v += d_x through it.
  void encode_kept_backward(const Coupling& coupling, const float* v, const float* d_x, float* d_v) const;

 private:
  /// Conditioner of one coupling: v (dims x kBlock) -> heads, |moved| rows of s and as many of t.
  void condition(const Coupling& coupling, const Packed& packed, const float* v, float* x, float* scratch,
                 float* heads) const;

  int m_dims;
  RealNvpSettings m_settings;
  std::vector<Coupling> m_couplings;
  std::size_t m_parameters = 0, m_packed = 0, m_packed_back = 0, m_activations = 0, m_scales = 0;
  std::size_t m_most_inputs = 0, m_most_moved = 0;
};

}  // namespace warpath::realnvp
