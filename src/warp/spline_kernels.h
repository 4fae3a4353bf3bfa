#pragma once
#include "nn/simd.h"

namespace warpath::spline {

// The elementwise steps of a spline flow over one block of nn::kBlock samples. A row is kBlock numbers of one dimension
// or one number for each sample; every pointer to a row is aligned to nn::kAlignment.
//
// A moved dimension goes through a monotone rational-quadratic spline S from [0,1] onto itself [DBMP19], z = S(y), so
// that S' is the density that a coupling gives to y. Its knots come from head_rows(bins) rows of a network's output:
// `bins` for the widths in y, `bins` for the heights in z (the mass of each bin), and bins + 1 for S' at the knots.
// Knots are float32 numbers, running sums of widths and heights; what is between them is float64. So S and its inverse
// differ by rounding of doubles alone.
inline constexpr int kMostBins = 64;
inline constexpr int head_rows(int bins) { return 3 * bins + 1; }

/// No bin is narrower or lower than this share of an even one.
inline constexpr float kLeastShare = 1.0f / 64;
/// |log2 S'| at a knot stays below this: 2^(h / (1 + |h| / kMostSlope)) of the network's output h.
inline constexpr float kMostSlope = 10.0f;

/// Doubles to floats below 1.
void narrow(const double* u, float* v);

/// What the networks see of a row of numbers u in [0,1), encoded_rows(bins) rows: 2 u - 1, and where u lies among
/// `bins` bins: for each a biweight (1 - (t / kBlobRadius)^2)^2 of its distance t from u, in bins. Muller et al. have a
/// Gaussian for that, the one-blob encoding [MMRGN19]; this one needs no exp and ends.
inline constexpr float kBlobRadius = 2.0f;
inline constexpr int encoded_rows(int bins) { return 1 + bins; }
void encode(int bins, const float* u, float* x);
/// d_u += d_x through encode.
void encode_backward(int bins, const float* u, const float* d_x, float* d_u);

/// y -> z = S(y) of one row, in place; density *= S'(y). heads: head_rows(bins) rows.
void squeeze(int bins, const float* heads, double* y, double* density);
/// z -> y = S^-1(z), in place; density *= S'(y) of the y handed out.
void stretch(int bins, const float* heads, double* z, double* density);

/// squeeze in float32, for training; log_q += ln S'(y).
void squeeze_for_training(int bins, const float* heads, const float* y, float* z, double* log_q);
/// Gradients through it of a loss that also holds -weight[i] ln S'(y_i): d is the loss's derivative with respect to z
/// and becomes that with respect to y. d_heads: head_rows(bins) rows.
void squeeze_backward(int bins, const float* heads, const float* y, const float* weight, float* d, float* d_heads);

/// log_density[i] += ln(density[i]), then density = 1.
void take_log(double* density, double* log_density);

}  // namespace warpath::spline
