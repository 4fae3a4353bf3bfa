#pragma once
#include <cstdint>

#include "nn/dense.h"

// The layers of nn/dense.h with products of bfloat16 and sums of floats, for training on CPUs with AVX512_BF16, which
// multiply twice as many of these as of floats. They need `available()`.
//
// A block's rows stand in pairs: word p * kBlock + s holds rows 2p (its low half) and 2p + 1 of sample s; beside an odd
// last row stands zero. Packed weights as in nn/dense.h, with a word for the weights of two inputs.

namespace warpath::nn::bf16 {

using Pair = std::uint32_t;

inline constexpr int pairs(int rows) { return (rows + 1) / 2; }

/// Whether this CPU has these kernels, and none is forced upon it (ForceSimdTarget).
bool available();

/// As nn::pack and nn::pack_transposed; gain is not null.
void pack(int inputs, int outputs, const float* weight, const float* gain, const float* bias, Pair* packed);
void pack_transposed(int inputs, int outputs, const float* weight, const float* gain, Pair* packed);

/// Rounds a block to the nearest bfloat16 (ties to even). `to` may be the memory of x.
void narrow(int rows, const float* x, Pair* to);

/// y = relu(W x + b), or relu(W x + b + skip) if there is a skip. outputs is even.
void dense(int inputs, int outputs, const Pair* packed, const Pair* x, Pair* y, const Pair* skip = nullptr);
/// y (+)= W x + b, in floats.
void dense_out(int inputs, int outputs, const Pair* packed, const Pair* x, float* y, bool accumulate);

/// Gradients of a layer's outputs in both forms that are needed: in pairs of rows, to carry them on to the inputs, and
/// in rows of kBlock / 2 pairs of samples, to have those of the weights.
struct Gradient {
  Pair* pairs;
  Pair* rows;
};
void narrow_gradient(int rows, const float* g, Gradient to);
/// Carries g through W^T (pack_transposed), adds `skip` if it is not null, and puts zero where `act` is; skip may be
/// to.pairs. inputs, outputs: of W^T; outputs is even.
void dense_back(int inputs, int outputs, const Pair* packed, const Pair* g, const Pair* skip, const Pair* act,
                Gradient to);

/// x, pairs of rows -> panels of 16 rows: xt[panel][pair of samples][16], rows padded with zeros.
void transpose(int rows, const Pair* x, Pair* xt);
/// As nn::dense_gradient; g: Gradient::rows.
void dense_gradient(int inputs, int outputs, const Pair* g, const Pair* xt, float* d_weight, float* d_bias,
                    bool accumulate);

}  // namespace warpath::nn::bf16
