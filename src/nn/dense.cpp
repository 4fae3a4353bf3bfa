#include "nn/dense.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nn/dense.cpp"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace warpath::nn::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;
constexpr D d;
constexpr int kLanes = hn::MaxLanes(D());
// Register tile, neurons x vectors: 16 accumulators of 32 registers with AVX-512, 8 of 16 with AVX2. Both hide the
// latency of the FMA units (4 cycles x 2) and need fewer loads than FMAs. Square tiles need the fewest.
constexpr int kTileRows = 4;
constexpr int kTileCols = kLanes == 16 ? 4 : 2;

// max(v, 0) by integers, whose order among themselves is that of positive floats: another port than the FMAs'.
HWY_INLINE V Positive(V v) {
  const hn::RebindToSigned<D> di;
  return hn::BitCast(d, hn::Max(hn::BitCast(di, v), hn::Zero(di)));
}

struct Linear {
  HWY_INLINE V operator()(V v, int) const { return v; }
};
struct Relu {
  HWY_INLINE V operator()(V v, int) const { return Positive(v); }
};
struct AddRelu {
  const float* skip;
  HWY_INLINE V operator()(V v, int i) const { return Positive(hn::Add(v, hn::Load(d, skip + i))); }
};
struct Add {
  const float* skip;
  HWY_INLINE V operator()(V v, int i) const { return hn::Add(v, hn::Load(d, skip + i)); }
};
struct Gate {
  const float* act;
  HWY_INLINE V operator()(V v, int i) const { return hn::IfThenElseZero(hn::Gt(hn::Load(d, act + i), hn::Zero(d)), v); }
};
struct AddGate {
  const float* skip;
  const float* act;
  HWY_INLINE V operator()(V v, int i) const {
    return hn::IfThenElseZero(hn::Gt(hn::Load(d, act + i), hn::Zero(d)), hn::Add(v, hn::Load(d, skip + i)));
  }
};

// Rows [row, row + R) of a group, for all samples; w: the group, x: the block, y_row: place of the first row in y.
template <int R, int C, class F>
HWY_INLINE void Tile(int inputs, const float* HWY_RESTRICT w, const float* HWY_RESTRICT x, float* y, int y_row, F f) {
  for (int s = 0; s < kBlock; s += C * kLanes) {
    V acc[R][C];
    HWY_UNROLL(8)
    for (int r = 0; r < R; ++r) {
      HWY_UNROLL(4)
      for (int c = 0; c < C; ++c) acc[r][c] = hn::Set(d, w[r]);
    }
    const float* HWY_RESTRICT wk = w + kGroup;
    const float* HWY_RESTRICT xk = x + s;
    for (int k = 0; k < inputs; ++k, wk += kGroup, xk += kBlock) {
      V xv[C];
      HWY_UNROLL(4)
      for (int c = 0; c < C; ++c) xv[c] = hn::Load(d, xk + c * kLanes);
      HWY_UNROLL(8)
      for (int r = 0; r < R; ++r) {
        const V wv = hn::Set(d, wk[r]);
        HWY_UNROLL(4)
        for (int c = 0; c < C; ++c) acc[r][c] = hn::MulAdd(wv, xv[c], acc[r][c]);
      }
    }
    HWY_UNROLL(8)
    for (int r = 0; r < R; ++r) {
      HWY_UNROLL(4)
      for (int c = 0; c < C; ++c) {
        const int i = (y_row + r) * kBlock + s + c * kLanes;
        hn::Store(f(acc[r][c], i), d, y + i);
      }
    }
  }
}

template <class F>
HWY_INLINE void Layer(int inputs, int outputs, const float* w, const float* x, float* y, F f) {
  for (int o = 0; o < outputs; o += kGroup, w += kGroup * (inputs + 1)) {
    int row = 0;
    const int rows = HWY_MIN(outputs - o, kGroup);
    for (; row + kTileRows <= rows; row += kTileRows) Tile<kTileRows, kTileCols>(inputs, w + row, x, y, o + row, f);
    for (; row + 2 <= rows; row += 2) Tile<2, 4>(inputs, w + row, x, y, o + row, f);
    for (; row < rows; ++row) Tile<1, 4>(inputs, w + row, x, y, o + row, f);
  }
}

void Dense(Epilogue epilogue, int inputs, int outputs, const float* w, const float* x, float* y, const float* skip,
           const float* act) {
  switch (epilogue) {
    case Epilogue::linear:
      return Layer(inputs, outputs, w, x, y, Linear{});
    case Epilogue::relu:
      return Layer(inputs, outputs, w, x, y, Relu{});
    case Epilogue::add_relu:
      return Layer(inputs, outputs, w, x, y, AddRelu{skip});
    case Epilogue::add:
      return Layer(inputs, outputs, w, x, y, Add{skip});
    case Epilogue::gate:
      return Layer(inputs, outputs, w, x, y, Gate{act});
    case Epilogue::add_gate:
      return Layer(inputs, outputs, w, x, y, AddGate{skip, act});
  }
}

// One square of kLanes features x kLanes samples. rows: the features, kBlock apart; out: kLanes samples, 16 apart.
HWY_INLINE void TransposeSquare(const float* HWY_RESTRICT rows, int features, float* HWY_RESTRICT out) {
  const hn::Repartition<double, D> dd;
  V v[kLanes];
  HWY_UNROLL(16)
  for (int i = 0; i < kLanes; ++i) v[i] = i < features ? hn::Load(d, rows + i * kBlock) : hn::Zero(d);
  // Squares of 4 x 4 within the 128-bit blocks, by interleaving single and double words.
  V t[kLanes];
  HWY_UNROLL(4)
  for (int i = 0; i < kLanes; i += 4) {
    const auto ab_lo = hn::BitCast(dd, hn::InterleaveLower(d, v[i], v[i + 1]));
    const auto ab_hi = hn::BitCast(dd, hn::InterleaveUpper(d, v[i], v[i + 1]));
    const auto cd_lo = hn::BitCast(dd, hn::InterleaveLower(d, v[i + 2], v[i + 3]));
    const auto cd_hi = hn::BitCast(dd, hn::InterleaveUpper(d, v[i + 2], v[i + 3]));
    t[i + 0] = hn::BitCast(d, hn::InterleaveLower(dd, ab_lo, cd_lo));
    t[i + 1] = hn::BitCast(d, hn::InterleaveUpper(dd, ab_lo, cd_lo));
    t[i + 2] = hn::BitCast(d, hn::InterleaveLower(dd, ab_hi, cd_hi));
    t[i + 3] = hn::BitCast(d, hn::InterleaveUpper(dd, ab_hi, cd_hi));
  }
  // t[4 q + j], 128-bit block b: sample 4 b + j, features 4 q .. 4 q + 3. Now the blocks change places with q.
  HWY_UNROLL(4)
  for (int j = 0; j < 4; ++j) {
    if constexpr (kLanes == 8) {
      hn::Store(hn::ConcatLowerLower(d, t[4 + j], t[j]), d, out + j * 16);
      hn::Store(hn::ConcatUpperUpper(d, t[4 + j], t[j]), d, out + (4 + j) * 16);
    } else {
      const V a = t[j], b = t[4 + j], c = t[8 + j], e = t[12 + j];
      const V ab_even = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(b), a);
      const V ab_odd = hn::OddEvenBlocks(b, hn::SwapAdjacentBlocks(a));
      const V ce_even = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(e), c);
      const V ce_odd = hn::OddEvenBlocks(e, hn::SwapAdjacentBlocks(c));
      hn::Store(hn::ConcatLowerLower(d, ce_even, ab_even), d, out + j * 16);
      hn::Store(hn::ConcatLowerLower(d, ce_odd, ab_odd), d, out + (4 + j) * 16);
      hn::Store(hn::ConcatUpperUpper(d, ce_even, ab_even), d, out + (8 + j) * 16);
      hn::Store(hn::ConcatUpperUpper(d, ce_odd, ab_odd), d, out + (12 + j) * 16);
    }
  }
}

void Transpose(int features, const float* HWY_RESTRICT x, float* HWY_RESTRICT xt) {
  for (int f = 0; f < padded_inputs(features); f += kLanes)
    for (int s = 0; s < kBlock; s += kLanes)
      TransposeSquare(x + f * kBlock + s, features - f, xt + (f / 16 * kBlock + s) * 16 + f % 16);
}

// R rows of g against P panels of 16 inputs each.
template <int R, int P>
HWY_INLINE void GradientTile(const float* HWY_RESTRICT g, const float* HWY_RESTRICT xt, float* HWY_RESTRICT dw,
                             int stride, bool accumulate) {
  constexpr int C = P * 16 / kLanes;
  V acc[R][C];
  HWY_UNROLL(8)
  for (int r = 0; r < R; ++r) {
    HWY_UNROLL(4)
    for (int c = 0; c < C; ++c) acc[r][c] = accumulate ? hn::Load(d, dw + r * stride + c * kLanes) : hn::Zero(d);
  }
  for (int s = 0; s < kBlock; ++s, ++g, xt += 16) {
    V xv[C];
    HWY_UNROLL(4)
    for (int c = 0; c < C; ++c) {
      const int lane = c * kLanes;
      xv[c] = hn::Load(d, xt + lane / 16 * (kBlock * 16) + lane % 16);
    }
    HWY_UNROLL(8)
    for (int r = 0; r < R; ++r) {
      const V gv = hn::Set(d, g[r * kBlock]);
      HWY_UNROLL(4)
      for (int c = 0; c < C; ++c) acc[r][c] = hn::MulAdd(gv, xv[c], acc[r][c]);
    }
  }
  HWY_UNROLL(8)
  for (int r = 0; r < R; ++r) {
    HWY_UNROLL(4)
    for (int c = 0; c < C; ++c) hn::Store(acc[r][c], d, dw + r * stride + c * kLanes);
  }
}

// The panels of all inputs for R rows; two panels at a time with AVX-512 (8 x 2 vectors), one with AVX2 (4 x 2).
template <int R>
HWY_INLINE void GradientRows(int panels, const float* g, const float* xt, float* dw, bool accumulate) {
  constexpr int P = kLanes == 16 ? 2 : 1;
  int p = 0;
  for (; p + P <= panels; p += P) GradientTile<R, P>(g, xt + p * kBlock * 16, dw + p * 16, panels * 16, accumulate);
  for (; p < panels; ++p) GradientTile<R, 1>(g, xt + p * kBlock * 16, dw + p * 16, panels * 16, accumulate);
}

void DenseGradient(int inputs, int outputs, const float* g, const float* xt, float* dw, float* db, bool accumulate) {
  const int stride = padded_inputs(inputs), panels = stride / 16;
  constexpr int kRows = kLanes == 16 ? 8 : 4;
  int o = 0;
  for (; o + kRows <= outputs; o += kRows) GradientRows<kRows>(panels, g + o * kBlock, xt, dw + o * stride, accumulate);
  for (; o + 2 <= outputs; o += 2) GradientRows<2>(panels, g + o * kBlock, xt, dw + o * stride, accumulate);
  for (; o < outputs; ++o) GradientRows<1>(panels, g + o * kBlock, xt, dw + o * stride, accumulate);
  for (o = 0; o < outputs; ++o) {
    V sum = hn::Load(d, g + o * kBlock);
    for (int s = kLanes; s < kBlock; s += kLanes) sum = hn::Add(sum, hn::Load(d, g + o * kBlock + s));
    const float total = hn::GetLane(hn::SumOfLanes(d, sum));
    db[o] = accumulate ? db[o] + total : total;
  }
}

}  // namespace warpath::nn::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace warpath::nn {

HWY_EXPORT(Dense);
HWY_EXPORT(Transpose);
HWY_EXPORT(DenseGradient);

void dense(Epilogue epilogue, int inputs, int outputs, const float* packed, const float* x, float* y, const float* skip,
           const float* act) {
  HWY_DYNAMIC_DISPATCH(Dense)(epilogue, inputs, outputs, packed, x, y, skip, act);
}

void transpose(int features, const float* x, float* xt) { HWY_DYNAMIC_DISPATCH(Transpose)(features, x, xt); }

void dense_gradient(int inputs, int outputs, const float* g, const float* xt, float* d_weight, float* d_bias,
                    bool accumulate) {
  HWY_DYNAMIC_DISPATCH(DenseGradient)(inputs, outputs, g, xt, d_weight, d_bias, accumulate);
}

void pack(int inputs, int outputs, const float* weight, const float* gain, const float* bias, float* packed) {
  const int stride = padded_inputs(inputs);
  for (int o = 0; o < outputs; o += kGroup, packed += kGroup * (inputs + 1))
    for (int r = 0; r < kGroup; ++r) {
      const bool real = o + r < outputs;
      const float scale = !real ? 0.0f : gain ? gain[o + r] : 1.0f;
      const float* row = weight + (real ? o + r : o) * stride;
      packed[r] = real ? bias[o + r] : 0.0f;
      for (int k = 0; k < inputs; ++k) packed[(k + 1) * kGroup + r] = scale * row[k];
    }
}

void pack_transposed(int inputs, int outputs, const float* weight, const float* gain, float* packed) {
  const int stride = padded_inputs(inputs);
  for (int k = 0; k < inputs; k += kGroup, packed += kGroup * (outputs + 1)) {
    for (int r = 0; r < kGroup; ++r) packed[r] = 0;
    // Rows of W are padded with zeros to a multiple of kGroup.
    for (int o = 0; o < outputs; ++o) {
      const float scale = gain ? gain[o] : 1.0f;
      for (int r = 0; r < kGroup; ++r) packed[(o + 1) * kGroup + r] = scale * weight[o * stride + k + r];
    }
  }
}

}  // namespace warpath::nn
#endif  // HWY_ONCE
