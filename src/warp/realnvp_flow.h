#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "nn/residual_net.h"
#include "warp/coupling_flow.h"
#include "warp/flow_settings.h"

namespace warpath::realnvp {

/// One affine coupling: the networks see the kept dimensions and say how the moved ones are scaled and shifted.
struct Coupling {
  std::vector<int> kept, moved;
  std::vector<nn::ResidualNet> nets;  ///< s and t; or one with the outputs of both, s first
  // Place of each net's numbers in the flow's arrays, and of the scales a, one for each moved dimension.
  std::vector<std::size_t> parameters, packed, packed_back, activations;
  std::size_t scales = 0;
};

/// Real NVP's stack of couplings.
class Flow final : public CouplingFlow {
 public:
  /// Throws ConfigError for settings that make no flow.
  Flow(int dims, const RealNvpSettings& settings);

  int dims() const override { return m_dims; }
  const RealNvpSettings& settings() const { return m_settings; }
  const std::vector<Coupling>& couplings() const { return m_couplings; }
  std::size_t parameter_count() const override { return m_parameters; }
  std::size_t coupling_count() const override { return m_couplings.size(); }
  std::size_t first_parameter(std::size_t coupling) const override;
  std::vector<ParameterView> views() const override;
  std::size_t multiply_adds() const override;

  /// Every s is 0 because its scale is, every t because its last layer is.
  nn::AlignedVector<float> initial(std::uint64_t seed) const override;

  void resize(PackedParameters& packed, bool back) const override;
  void pack_coupling(std::size_t coupling, const float* parameters, PackedParameters& packed) const override;

  std::size_t scratch_count() const override;
  void forward(const PackedParameters& packed, const double* z, double* y, double* log_det,
               float* scratch) const override;
  void inverse(const PackedParameters& packed, const double* y, double* z, double* log_det,
               float* scratch) const override;

  std::size_t training_scratch_count() const override;
  double train_block(const PackedParameters& packed, const double* y, const float* context, const float* weight,
                     const float* target, const FlowObjective& objective, float* gradients, bool accumulate,
                     float* scratch) const override;
  void unfold(std::size_t coupling, const float* parameters, float* gradients) const override;

  /// What a coupling's networks see: v (dims x kBlock) -> x (inputs x kBlock).
  void encode_kept(const Coupling& coupling, const float* v, float* x) const;
  /// d_v += d_x through it.
  void encode_kept_backward(const Coupling& coupling, const float* v, const float* d_x, float* d_v) const;

 private:
  /// Conditioner of one coupling: v (dims x kBlock) -> heads, |moved| rows of s and as many of t.
  void condition(const Coupling& coupling, const PackedParameters& packed, const float* v, float* x, float* scratch,
                 float* heads) const;

  int m_dims;
  RealNvpSettings m_settings;
  std::vector<Coupling> m_couplings;
  std::size_t m_parameters = 0, m_packed = 0, m_packed_back = 0, m_activations = 0, m_scales = 0;
  std::size_t m_most_inputs = 0, m_most_moved = 0, m_backward_scratch = 0;
};

}  // namespace warpath::realnvp
