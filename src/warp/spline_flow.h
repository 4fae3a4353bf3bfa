#pragma once
#include "nn/residual_net.h"
#include "warp/coupling_flow.h"
#include "warp/flow_settings.h"

namespace warpath::spline {

/// One coupling: a network sees the context and the kept dimensions, and says how each of the moved ones is bent,
/// spline::head_rows of its outputs for each.
struct Coupling {
  std::vector<int> kept, moved;
  bool sees_moved = false;  ///< whether y reaches it with kept dimensions that others moved: then gradients go on
  nn::ResidualNet net;
  std::size_t parameters, packed, packed_back, activations;  ///< place of the net's numbers in the flow's arrays
};

/// A stack of rational-quadratic spline couplings [DBMP19] over the hypercube. With a context, numbers that every
/// network sees, its density is conditioned on that.
class Flow final : public CouplingFlow {
 public:
  /// Throws ConfigError for settings that make no flow.
  Flow(int dims, const SplineSettings& settings, int context_rows = 0);

  int dims() const override { return m_dims; }
  const SplineSettings& settings() const { return m_settings; }
  const std::vector<Coupling>& couplings() const { return m_couplings; }
  std::size_t parameter_count() const override { return m_parameters; }
  std::size_t coupling_count() const override { return m_couplings.size(); }
  std::size_t first_parameter(std::size_t coupling) const override;
  std::vector<ParameterView> views() const override;
  std::size_t multiply_adds() const override;
  int context_rows() const override { return m_context_rows; }

  /// Even bins and slopes of 1, because the last layers are 0.
  nn::AlignedVector<float> initial(std::uint64_t seed) const override;

  void resize(PackedParameters& packed, bool back) const override;
  void pack_coupling(std::size_t coupling, const float* parameters, PackedParameters& packed) const override;

  std::size_t scratch_count() const override;
  void forward(const PackedParameters& packed, const double* z, double* y, double* log_det,
               float* scratch) const override {
    forward(packed, z, nullptr, y, log_det, scratch);
  }
  void inverse(const PackedParameters& packed, const double* y, double* z, double* log_det,
               float* scratch) const override {
    inverse(packed, y, nullptr, z, log_det, scratch);
  }
  /// The same given a context, context_rows() x kBlock.
  void forward(const PackedParameters& packed, const double* z, const float* context, double* y, double* log_det,
               float* scratch) const;
  void inverse(const PackedParameters& packed, const double* y, const float* context, double* z, double* log_det,
               float* scratch) const;

  std::size_t training_scratch_count() const override;
  double train_block(const PackedParameters& packed, const double* y, const float* context, const float* weight,
                     const float* target, const FlowObjective& objective, float* gradients, bool accumulate,
                     float* scratch) const override;
  void unfold(std::size_t, const float*, float*) const override {}  // weights are packed as they are

 private:
  /// The outputs of one coupling's network: v (dims x kBlock) -> heads. The context is in the scratch: see put_context.
  void condition(const Coupling& coupling, const PackedParameters& packed, const double* v, float* scratch,
                 float* heads) const;
  /// x begins with the context, which all networks share; behind it are the kept dimensions of one.
  void put_context(const float* context, float* x) const;
  void encode_kept(const Coupling& coupling, const float* v, float* x) const;

  int m_dims, m_context_rows;
  SplineSettings m_settings;
  std::vector<Coupling> m_couplings;
  std::size_t m_parameters = 0, m_packed = 0, m_packed_back = 0, m_activations = 0;
  std::size_t m_most_inputs = 0, m_most_outputs = 0, m_backward_scratch = 0;
};

}  // namespace warpath::spline
