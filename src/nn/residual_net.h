#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "nn/simd.h"

namespace warpath::nn {

/// How the dense layers before a ReLU are normalised.
enum class Norm {
  none,
  actnorm,  ///< a learned gain per neuron, set from data at the start (Kingma and Dhariwal 2018); folded into the
            ///< weights
  batch,    ///< batch normalisation (Ioffe and Szegedy 2015); its statistics are folded in for use
};

/// What training multiplies; sums, parameters and their optimiser are floats, and so is all of inference.
enum class Products { floats, bf16 };

/// bf16 where the CPU has the kernels (nn/dense_bf16.h).
Products fastest_products();

/// Added to variances before their root is taken, as PyTorch has it.
inline constexpr float kBatchNormEpsilon = 1e-5f;

/// One dense layer's place in the network's parameters. Rows of the weights are padded_inputs(inputs) apart.
struct DenseLayer {
  int inputs = 0, outputs = 0;
  std::size_t weight = 0, bias = 0;
  std::size_t gain = 0;                ///< if normalised
  std::size_t mean = 0, variance = 0;  ///< running statistics of batch normalisation; no gradient reaches them
  bool normalised = false;
  std::size_t packed = 0, packed_back = 0;  ///< place in the packed weights, and in the packed transposes
};

/// The conditioner of [ZZ19]: dense -> residual blocks of two dense layers each -> dense.
///   h_0 = relu(N(W x));  a = relu(N(W h)), h' = relu(h + N(W a)) for each block;  out = W h.
class ResidualNet {
 public:
  ResidualNet() = default;
  /// width is a multiple of 16. Without inputs the outputs are constants that are learned: a bias, and no hidden layers
  /// unless they are normalised.
  ResidualNet(int inputs, int width, int blocks, int outputs, Norm norm, Products products = fastest_products());

  int inputs() const { return m_layers.front().inputs; }
  int outputs() const { return m_layers.back().outputs; }
  int width() const { return m_width; }
  Norm norm() const { return m_norm; }
  const std::vector<DenseLayer>& layers() const { return m_layers; }  ///< in, then pairs, then out; or out alone
  std::size_t parameter_count() const { return m_parameters; }        ///< padding included; a multiple of 16
  std::size_t packed_count() const { return m_packed; }
  std::size_t packed_back_count() const { return m_packed_back; }
  /// Floats that `forward` keeps for `backward`: the inputs and the activations of every hidden layer.
  std::size_t activation_count() const {
    return input_count() + (m_layers.size() - 1) * static_cast<std::size_t>(m_width * kBlock);
  }
  /// Multiply-adds of one sample's forward pass.
  std::size_t multiply_adds() const;

  /// Uniform weights with the variance 2 / inputs (He et al. 2015), zero biases, gains 1; the last layer is scaled by
  /// `last`. `key` seeds them.
  void initialise(float* parameters, std::uint64_t key, float last) const;

  /// Packs the weights with gains, and running statistics of batch normalisation, folded in.
  void pack(const float* parameters, float* packed) const;
  /// The same for `forward` and `backward`.
  void pack_for_training(const float* parameters, float* packed, float* packed_back) const;
  /// Packs the weights of normalised layers as they are, without biases: what training with batch normalisation needs.
  void pack_plain(const float* parameters, float* packed, float* packed_back) const;

  /// One block. x: inputs x kBlock; out: outputs x kBlock; scratch: 2 * width * kBlock floats.
  void infer(const float* packed, const float* x, float* scratch, float* out) const;

  /// One block in training. activations: activation_count() floats, of which the first inputs x kBlock are the inputs;
  /// all are for `backward` alone from here on.
  void forward(const float* packed, float* activations, float* out) const;
  /// Gradients of one block, from those of its outputs (outputs x kBlock). gradients has the layout of the parameters,
  /// of the weights as they are packed (gains folded in: see unfold). d_x: inputs x kBlock, or null; it is added to
  /// what is there if `accumulate_x`. scratch: scratch_count() floats.
  void backward(const float* packed_back, const float* activations, const float* d_out, float* gradients,
                bool accumulate, float* d_x, bool accumulate_x, float* scratch) const;
  std::size_t scratch_count() const;

  /// Turns gradients of the folded weights W = gain * V into those of V and gain, in place (actnorm only).
  void unfold(const float* parameters, float* gradients) const;

 private:
  std::size_t input_count() const { return static_cast<std::size_t>(inputs() * kBlock); }
  void forward_bf16(const float* packed, float* activations, float* out) const;
  void backward_bf16(const float* packed_back, const float* activations, const float* d_out, float* gradients,
                     bool accumulate, float* d_x, bool accumulate_x, float* scratch) const;

  int m_width = 0;
  Norm m_norm = Norm::none;
  Products m_products = Products::floats;
  std::vector<DenseLayer> m_layers;
  std::size_t m_parameters = 0, m_packed = 0, m_packed_back = 0;
};

}  // namespace warpath::nn
