#pragma once
#include "nn/simd.h"

namespace warpath::nn {

// Dense layers over one block of kBlock samples.
//
// Weights in memory: W[outputs][stride] row-major with stride = padded_inputs(inputs), zeros in the padding;
// bias[outputs]. Packed weights: neurons in groups of kGroup; a group is kGroup biases, then for each input its kGroup
// weights. All pointers to packed weights, activations and gradients are aligned to kAlignment.

inline constexpr int kGroup = 8;

inline constexpr int padded_inputs(int inputs) { return round_up(inputs, 16); }
inline constexpr int packed_size(int inputs, int outputs) { return round_up(outputs, kGroup) * (inputs + 1); }

/// What happens to W x + b on its way to memory.
enum class Epilogue {
  linear,    ///< y = v
  relu,      ///< y = max(v, 0)
  add_relu,  ///< y = max(v + skip, 0)
  add,       ///< y = v + skip
  gate,      ///< y = act > 0 ? v : 0
  add_gate,  ///< y = act > 0 ? v + skip : 0
};

/// y = epilogue(W x + b). x: inputs x kBlock; y, skip, act: outputs x kBlock; y may be the memory of skip.
/// The backward pass is the same kernel with pack_transposed weights.
void dense(Epilogue epilogue, int inputs, int outputs, const float* packed, const float* x, float* y,
           const float* skip = nullptr, const float* act = nullptr);

/// Packs W with each row scaled by gain (null for 1) and the bias for `dense`.
void pack(int inputs, int outputs, const float* weight, const float* gain, const float* bias, float* packed);
/// Packs the transpose of the same matrix, without bias: what `dense` needs to carry gradients from outputs to inputs.
void pack_transposed(int inputs, int outputs, const float* weight, const float* gain, float* packed);

/// x: features x kBlock -> panels of 16 features: xt[panel][sample][16], features padded with zeros to padded_inputs.
void transpose(int features, const float* x, float* xt);

/// Gradient of W and b over one block: dW[o][k] (+)= sum_s g[o][s] x[k][s], db[o] (+)= sum_s g[o][s].
/// g: outputs x kBlock; xt: the inputs, transposed; it is added to what is there if `accumulate`.
void dense_gradient(int inputs, int outputs, const float* g, const float* xt, float* d_weight, float* d_bias,
                    bool accumulate);

}  // namespace warpath::nn
