#pragma once
#include <span>

#include "nn/simd.h"

namespace warpath::realnvp {

// The elementwise steps of a Real NVP flow over one block of nn::kBlock samples. A row is kBlock numbers of one
// dimension, rows follow each other; every pointer to rows is aligned to nn::kAlignment.
//
// The flow lives in logit space: v = ln(z / (1 - z)). Couplings are affine for |v| <= kEdge and go on with slope 1
// beyond it, so that densities stay finite at the border of the hypercube, where a scale would take them to 0 or
// infinity. kEdge plays the part of the squeeze by 1e-7 in the code of [ZZ19]: logit(1e-7) = -16.1.
inline constexpr float kEdge = 8.0f;

/// v = logit of rows of numbers in [0,1), cut off at +-85. Error 2 ULP of float.
void logit(int rows, const double* z, float* v);

/// Ends what logit began: moves the rows z by v1 - v0 in logit space, y = z / (z + (1 - z) e^(v0 - v1)), and adds
/// ln dy/dz at constant v1 - v0 of all of them, fewer than 1024, to log_det. Exactly the identity where v1 = v0; y may
/// be the memory of z.
void shift_logit(int rows, const double* z, const float* v0, const float* v1, double* y, double* log_det);

/// What the networks see of a row, encoded_rows(bins) rows: v, cut off at +-kEdge, and where u = sigmoid(v) lies among
/// `bins` bins of [0,1): for each a biweight (1 - (t / kBlobRadius)^2)^2 of its distance t from u, in bins. Muller et
/// al. have a Gaussian for that, the one-blob encoding [MMRGN19]; this one needs no exp and ends.
inline constexpr float kBlobRadius = 2.0f;
inline constexpr int encoded_rows(int bins) { return 1 + bins; }
void encode(int bins, const float* v, float* x);
/// d_v += d_x through encode.
void encode_backward(int bins, const float* v, const float* d_x, float* d_v);

/// z -> y of the rows of v that are moved, v' = v e^s + t with s = a tanh(h_s) and t = h_t; log_det += s.  [DSB17],
/// [ZZ19]. a: one for each moved row; heads: h_s of each, then h_t of each.
void couple(std::span<const int> moved, const float* a, const float* heads, float* v, double* log_det);
/// y -> z, v' = (v - t) e^-s; log_det -= s.
void uncouple(std::span<const int> moved, const float* a, const float* heads, float* v, double* log_det);
/// Gradients of one row through uncouple of a loss that also holds -weight[i] * log_det[i]. v: the row before uncouple;
/// d_v: the loss's derivative with respect to the row after it, becomes that with respect to the row before. Returns
/// dLoss/da.
float uncouple_backward(float a, const float* h_s, const float* h_t, const float* weight, const float* v, float* d_v,
                        float* d_h_s, float* d_h_t);

/// log_q += the sum of the rows' ln(sigmoid'(v)), the density of a uniform number's logit; log_q -= that if `minus`.
void add_log_logistic(int rows, const float* v, bool minus, double* log_q);
/// d_v = derivative of -weight ln(sigmoid'(v)) of each row.
void log_logistic_gradient(int rows, const float* weight, const float* v, float* d_v);

}  // namespace warpath::realnvp
