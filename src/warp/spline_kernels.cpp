#include "warp/spline_kernels.h"

#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "warp/spline_kernels.cpp"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// After highway.h, which it needs.
#include <hwy/contrib/math/math-inl.h>

#include "warp/exp2-inl.h"

HWY_BEFORE_NAMESPACE();
namespace warpath::spline::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;
constexpr D d;
constexpr hn::RebindToSigned<D> di;
constexpr int kLanes = hn::MaxLanes(D());
// Doubles, and as many floats.
using DD = hn::CappedTag<double, 8>;
using VD = hn::Vec<DD>;
constexpr DD dd;
constexpr hn::Rebind<float, DD> df;
constexpr int kDoubles = hn::MaxLanes(DD());
using nn::kBlock;
using warpath::HWY_NAMESPACE::Exp2;

constexpr float kBelowOneFloat = 0x1.fffffep-1f;
constexpr double kBelowOne = 0x1.fffffffffffffp-1;

HWY_INLINE VD LoadDoubles(const float* p) { return hn::PromoteTo(dd, hn::Load(df, p)); }

/// Widths or heights of the bins of some samples: each is least + slope * e[j], and all add up to 1.
struct Softmax {
  V e[kMostBins];
  V least, slope, inverse_sum;

  /// h: one row for each bin.
  HWY_INLINE void Compute(int bins, const float* HWY_RESTRICT h) {
    V most = hn::Load(d, h);
    for (int j = 1; j < bins; ++j) most = hn::Max(most, hn::Load(d, h + j * kBlock));
    const V floor = hn::Set(d, -126.0f);
    V sum = hn::Zero(d);
    for (int j = 0; j < bins; ++j) {
      e[j] = Exp2(d, hn::Max(hn::Sub(hn::Load(d, h + j * kBlock), most), floor));
      sum = hn::Add(sum, e[j]);
    }
    inverse_sum = hn::Div(hn::Set(d, 1.0f), sum);
    least = hn::Set(d, kLeastShare / static_cast<float>(bins));
    slope = hn::Mul(hn::Set(d, 1 - kLeastShare), inverse_sum);
  }
  /// The knot after knot j.
  HWY_INLINE V Next(int j, V knot) const { return hn::Add(knot, hn::MulAdd(slope, e[j], least)); }
};

/// log2 S' at a knot.
HWY_INLINE V LogSlope(V h) {
  const V one = hn::Set(d, 1.0f);
  return hn::Div(h, hn::MulAdd(hn::Abs(h), hn::Set(d, 1 / kMostSlope), one));
}

/// One bin of a spline: from (y0, z0) to (y1, z1), with the network's outputs for S' at either end.
struct Bin {
  V y0, y1, z0, z1, h0, h1;
};

/// The bins that hold `key`, which is a z if `by_height`, else a y. h: head_rows(bins) rows.
template <bool by_height>
HWY_INLINE Bin Find(int bins, const float* HWY_RESTRICT h, V key, const Softmax& widths, const Softmax& heights) {
  const float* HWY_RESTRICT slopes = h + 2 * bins * kBlock;
  const V one = hn::Set(d, 1.0f);
  V y = widths.Next(0, hn::Zero(d)), z = heights.Next(0, hn::Zero(d));
  Bin bin{hn::Zero(d), y, hn::Zero(d), z, hn::Load(d, slopes), hn::Load(d, slopes + kBlock)};
  for (int j = 1; j < bins; ++j) {
    const auto beyond = hn::Ge(key, by_height ? z : y);
    bin.y0 = hn::IfThenElse(beyond, y, bin.y0);
    bin.z0 = hn::IfThenElse(beyond, z, bin.z0);
    bin.h0 = hn::IfThenElse(beyond, bin.h1, bin.h0);
    y = j + 1 < bins ? widths.Next(j, y) : one;
    z = j + 1 < bins ? heights.Next(j, z) : one;
    bin.y1 = hn::IfThenElse(beyond, y, bin.y1);
    bin.z1 = hn::IfThenElse(beyond, z, bin.z1);
    bin.h1 = hn::IfThenElse(beyond, hn::Load(d, slopes + (j + 1) * kBlock), bin.h1);
  }
  return bin;
}

/// The bins of a whole row, ready for doubles.
struct BinRow {
  HWY_ALIGN float y0[kBlock], y1[kBlock], z0[kBlock], z1[kBlock], d0[kBlock], d1[kBlock];

  template <bool by_height>
  HWY_INLINE void Fill(int bins, const float* HWY_RESTRICT heads, const double* HWY_RESTRICT keys) {
    HWY_ALIGN float key[kBlock];
    for (int i = 0; i < kBlock; i += kDoubles) hn::Store(hn::DemoteTo(df, hn::Load(dd, keys + i)), df, key + i);
    Softmax widths, heights;
    for (int i = 0; i < kBlock; i += kLanes) {
      widths.Compute(bins, heads + i);
      heights.Compute(bins, heads + bins * kBlock + i);
      const Bin bin = Find<by_height>(bins, heads + i, hn::Load(d, key + i), widths, heights);
      hn::Store(bin.y0, d, y0 + i);
      hn::Store(bin.y1, d, y1 + i);
      hn::Store(bin.z0, d, z0 + i);
      hn::Store(bin.z1, d, z1 + i);
      hn::Store(Exp2(d, LogSlope(bin.h0)), d, d0 + i);
      hn::Store(Exp2(d, LogSlope(bin.h1)), d, d1 + i);
    }
  }
};

/// [DBMP19, eqs. 4 and 5] with a = y - y0 and b = y1 - y in place of the share xi of the bin, so that one division is
/// enough and nothing cancels: with w = y1 - y0 and h = z1 - z0,
///   S  = z0 + h a (h a + d0 w b) / Q,  S' = h^2 w (d1 w a^2 + 2 h a b + d0 w b^2) / Q^2,
///   Q  = h (a^2 + b^2) + (d0 + d1) w a b.
template <class DV, class W>
struct Rational {
  W a, b, w, h, d0, d1, ab, over_q;

  HWY_INLINE Rational(DV tag, W a_, W b_, W w_, W h_, W d0_, W d1_)
      : a(a_), b(b_), w(w_), h(h_), d0(d0_), d1(d1_), ab(hn::Mul(a_, b_)) {
    const W squares = hn::MulAdd(a, a, hn::Mul(b, b));
    const W q = hn::MulAdd(hn::Mul(hn::Add(d0, d1), w), ab, hn::Mul(h, squares));
    over_q = hn::Div(hn::Set(tag, 1), q);
  }
  /// S - z0
  HWY_INLINE W Rise() const {
    return hn::Mul(hn::Mul(hn::Mul(h, a), over_q), hn::MulAdd(hn::Mul(d0, w), b, hn::Mul(h, a)));
  }
  HWY_INLINE W Slope() const {
    const W ends = hn::MulAdd(hn::Mul(d1, a), a, hn::Mul(hn::Mul(d0, b), b));
    const W sum = hn::MulAdd(w, ends, hn::Mul(hn::Add(h, h), ab));
    const W scale = hn::Mul(h, over_q);
    return hn::Mul(hn::Mul(scale, w), hn::Mul(scale, sum));
  }
};

void Narrow(const double* HWY_RESTRICT u, float* HWY_RESTRICT v) {
  for (int i = 0; i < kBlock; i += kDoubles)
    hn::Store(hn::Min(hn::DemoteTo(df, hn::Load(dd, u + i)), hn::Set(df, kBelowOneFloat)), df, v + i);
}

void Encode(int bins, const float* HWY_RESTRICT u, float* HWY_RESTRICT x) {
  const V one = hn::Set(d, 1.0f), scale = hn::Set(d, 1 / kBlobRadius);
  for (int i = 0; i < kBlock; i += kLanes) {
    const V v = hn::Load(d, u + i);
    hn::Store(hn::Sub(hn::Add(v, v), one), d, x + i);
    V t = hn::Mul(hn::MulSub(v, hn::Set(d, static_cast<float>(bins)), hn::Set(d, 0.5f)), scale);
    for (int k = 1; k <= bins; ++k, t = hn::Sub(t, scale)) {
      const V hat = hn::Max(hn::NegMulAdd(t, t, one), hn::Zero(d));
      hn::Store(hn::Mul(hat, hat), d, x + k * kBlock + i);
    }
  }
}

void EncodeBackward(int bins, const float* HWY_RESTRICT u, const float* HWY_RESTRICT d_x, float* HWY_RESTRICT d_u) {
  const V one = hn::Set(d, 1.0f), scale = hn::Set(d, 1 / kBlobRadius);
  for (int i = 0; i < kBlock; i += kLanes) {
    const V v = hn::Load(d, u + i), g = hn::Load(d, d_x + i);
    V t = hn::Mul(hn::MulSub(v, hn::Set(d, static_cast<float>(bins)), hn::Set(d, 0.5f)), scale);
    V d_t = hn::Zero(d);
    for (int k = 1; k <= bins; ++k, t = hn::Sub(t, scale)) {
      const V hat = hn::Max(hn::NegMulAdd(t, t, one), hn::Zero(d));
      d_t = hn::MulAdd(hn::Mul(hat, t), hn::Load(d, d_x + k * kBlock + i), d_t);
    }
    const V sum = hn::MulAdd(d_t, hn::Set(d, -4.0f * static_cast<float>(bins) / kBlobRadius), hn::Add(g, g));
    hn::Store(hn::Add(hn::Load(d, d_u + i), sum), d, d_u + i);
  }
}

void Squeeze(int bins, const float* HWY_RESTRICT heads, double* HWY_RESTRICT y, double* HWY_RESTRICT density) {
  BinRow row;
  row.Fill<false>(bins, heads, y);
  for (int i = 0; i < kBlock; i += kDoubles) {
    const VD x = hn::Load(dd, y + i), y0 = LoadDoubles(row.y0 + i), y1 = LoadDoubles(row.y1 + i);
    const VD z0 = LoadDoubles(row.z0 + i), z1 = LoadDoubles(row.z1 + i);
    const Rational s(dd, hn::Sub(x, y0), hn::Sub(y1, x), hn::Sub(y1, y0), hn::Sub(z1, z0), LoadDoubles(row.d0 + i),
                     LoadDoubles(row.d1 + i));
    const VD z = hn::Min(hn::Max(hn::Add(z0, s.Rise()), hn::Zero(dd)), hn::Set(dd, kBelowOne));
    hn::Store(z, dd, y + i);
    hn::Store(hn::Mul(hn::Load(dd, density + i), s.Slope()), dd, density + i);
  }
}

/// [DBMP19, eqs. 6 to 8], times the bin's width: with c = z - z0, the share xi solves A xi^2 + B xi - h c = 0.
void Stretch(int bins, const float* HWY_RESTRICT heads, double* HWY_RESTRICT z, double* HWY_RESTRICT density) {
  BinRow row;
  row.Fill<true>(bins, heads, z);
  for (int i = 0; i < kBlock; i += kDoubles) {
    const VD y0 = LoadDoubles(row.y0 + i), y1 = LoadDoubles(row.y1 + i), z0 = LoadDoubles(row.z0 + i);
    const VD w = hn::Sub(y1, y0), h = hn::Sub(LoadDoubles(row.z1 + i), z0), c = hn::Sub(hn::Load(dd, z + i), z0);
    const VD d0 = LoadDoubles(row.d0 + i), d1 = LoadDoubles(row.d1 + i);
    const VD bend = hn::Mul(c, hn::MulSub(hn::Add(d0, d1), w, hn::Add(h, h))), start = hn::Mul(hn::Mul(h, d0), w);
    const VD A = hn::Add(hn::MulSub(h, h, start), bend), B = hn::Sub(start, bend), hc = hn::Mul(h, c);
    const VD root = hn::Sqrt(hn::Max(hn::MulAdd(hn::Mul(hn::Set(dd, 4.0), A), hc, hn::Mul(B, B)), hn::Zero(dd)));
    const VD a = hn::Mul(w, hn::Div(hn::Add(hc, hc), hn::Add(B, root)));
    const VD y = hn::Min(hn::Max(hn::Add(y0, a), hn::Zero(dd)), hn::Set(dd, kBelowOne));
    const Rational s(dd, a, hn::Sub(w, a), w, h, d0, d1);
    hn::Store(y, dd, z + i);
    hn::Store(hn::Mul(hn::Load(dd, density + i), s.Slope()), dd, density + i);
  }
}

void SqueezeForTraining(int bins, const float* HWY_RESTRICT heads, const float* HWY_RESTRICT y, float* HWY_RESTRICT z,
                        double* HWY_RESTRICT log_q) {
  HWY_ALIGN float terms[kBlock];
  Softmax widths, heights;
  for (int i = 0; i < kBlock; i += kLanes) {
    const V x = hn::Load(d, y + i);
    widths.Compute(bins, heads + i);
    heights.Compute(bins, heads + bins * kBlock + i);
    const Bin bin = Find<false>(bins, heads + i, x, widths, heights);
    const Rational s(d, hn::Sub(x, bin.y0), hn::Sub(bin.y1, x), hn::Sub(bin.y1, bin.y0), hn::Sub(bin.z1, bin.z0),
                     Exp2(d, LogSlope(bin.h0)), Exp2(d, LogSlope(bin.h1)));
    hn::Store(hn::Min(hn::Add(bin.z0, s.Rise()), hn::Set(d, kBelowOneFloat)), d, z + i);
    hn::Store(hn::Log(d, s.Slope()), d, terms + i);
  }
  for (int i = 0; i < kBlock; i += kDoubles)
    hn::Store(hn::Add(hn::Load(dd, log_q + i), LoadDoubles(terms + i)), dd, log_q + i);
}

/// Derivative of 2^LogSlope(h), which is `slope`.
HWY_INLINE V SlopeBackward(V h, V slope) {
  const V one = hn::Set(d, 1.0f);
  const V bound = hn::MulAdd(hn::Abs(h), hn::Set(d, 1 / kMostSlope), one);
  return hn::Div(hn::Mul(slope, hn::Set(d, std::numbers::ln2_v<float>)), hn::Mul(bound, bound));
}

/// The loss's derivatives with respect to a bin: where it starts, its width and height, and S' at its ends (as outputs
/// of the network).
struct BinGradient {
  V y0, w, z0, h, h0, h1;
};

/// From those to all of the network's outputs. Where a bin starts is the sum of the widths before it.
HWY_INLINE void BinBackward(int bins, const Softmax& widths, const Softmax& heights, V y, const BinGradient& g,
                            float* HWY_RESTRICT d_heads) {
  float* const d_widths = d_heads;
  float* const d_heights = d_heads + bins * kBlock;
  float* const d_slopes = d_heads + 2 * bins * kBlock;
  V by_width[kMostBins], by_height[kMostBins];
  V mean_w = hn::Zero(d), mean_h = hn::Zero(d), knot = hn::Zero(d), slope = hn::Zero(d);
  const V infinity = hn::Set(d, 3e38f);
  auto above = hn::Ge(infinity, knot);  // whether y lies above knot j
  for (int j = 0; j < bins; ++j) {
    knot = widths.Next(j, knot);
    const auto beyond = hn::Ge(y, j + 1 < bins ? knot : infinity);
    by_width[j] = hn::IfThenElse(beyond, g.y0, hn::IfThenElseZero(above, g.w));
    by_height[j] = hn::IfThenElse(beyond, g.z0, hn::IfThenElseZero(above, g.h));
    mean_w = hn::MulAdd(widths.e[j], by_width[j], mean_w);
    mean_h = hn::MulAdd(heights.e[j], by_height[j], mean_h);
    const auto inside = hn::AndNot(beyond, above);
    hn::Store(hn::IfThenElse(inside, g.h0, slope), d, d_slopes + j * kBlock);
    slope = hn::IfThenElseZero(inside, g.h1);
    above = beyond;
  }
  hn::Store(slope, d, d_slopes + bins * kBlock);
  const V scale_w = hn::Mul(widths.slope, hn::Set(d, std::numbers::ln2_v<float>)),
          scale_h = hn::Mul(heights.slope, hn::Set(d, std::numbers::ln2_v<float>));
  mean_w = hn::Mul(mean_w, widths.inverse_sum);
  mean_h = hn::Mul(mean_h, heights.inverse_sum);
  for (int j = 0; j < bins; ++j) {
    hn::Store(hn::Mul(hn::Mul(scale_w, widths.e[j]), hn::Sub(by_width[j], mean_w)), d, d_widths + j * kBlock);
    hn::Store(hn::Mul(hn::Mul(scale_h, heights.e[j]), hn::Sub(by_height[j], mean_h)), d, d_heights + j * kBlock);
  }
}

void SqueezeBackward(int bins, const float* HWY_RESTRICT heads, const float* HWY_RESTRICT y,
                     const float* HWY_RESTRICT weight, float* HWY_RESTRICT d_out, float* HWY_RESTRICT d_heads) {
  Softmax widths, heights;
  const V one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f);
  for (int i = 0; i < kBlock; i += kLanes) {
    const V x = hn::Load(d, y + i);
    widths.Compute(bins, heads + i);
    heights.Compute(bins, heads + bins * kBlock + i);
    const Bin bin = Find<false>(bins, heads + i, x, widths, heights);
    const V d0 = Exp2(d, LogSlope(bin.h0)), d1 = Exp2(d, LogSlope(bin.h1));
    // In terms of xi, s = h / w and t = xi (1 - xi), as in [DBMP19]:
    //   den = s + (d0 + d1 - 2 s) t,  rise = (s xi^2 + d0 t) / den,  z = z0 + h rise,
    //   N = d1 xi^2 + 2 s t + d0 (1 - xi)^2,  ln S' = 2 ln s + ln N - 2 ln den.
    const V w = hn::Sub(bin.y1, bin.y0), h = hn::Sub(bin.z1, bin.z0);
    const V over_w = hn::Div(one, w);
    const V s = hn::Mul(h, over_w), xi = hn::Mul(hn::Sub(x, bin.y0), over_w), rest = hn::Sub(one, xi);
    const V t = hn::Mul(xi, rest), turn = hn::Sub(rest, xi), xi2 = hn::Mul(xi, xi), rest2 = hn::Mul(rest, rest);
    const V curve = hn::Sub(hn::Add(d0, d1), hn::Add(s, s));
    const V over_den = hn::Div(one, hn::MulAdd(curve, t, s));
    const V rise = hn::Mul(hn::MulAdd(s, xi2, hn::Mul(d0, t)), over_den);
    const V n = hn::MulAdd(d1, xi2, hn::MulAdd(d0, rest2, hn::Mul(hn::Add(s, s), t)));
    const V over_n = hn::Div(one, n), over_s = hn::Mul(w, hn::Div(one, h));

    const V d_z = hn::Load(d, d_out + i), d_l = hn::Neg(hn::Load(d, weight + i));
    const V d_rise = hn::Mul(hn::Mul(d_z, h), over_den);  // with the division that all its derivatives share
    const V two_t = hn::Mul(two, hn::Mul(t, over_den));
    // d ln S' and d rise by s, d0, d1, xi
    const V l_s = hn::MulAdd(
        two, over_s, hn::MulSub(hn::Add(t, t), over_n, hn::Mul(two, hn::Mul(hn::NegMulAdd(two, t, one), over_den))));
    const V l_d0 = hn::MulSub(rest2, over_n, two_t), l_d1 = hn::MulSub(xi2, over_n, two_t);
    const V l_xi = hn::Mul(two, hn::MulSub(hn::MulAdd(d1, xi, hn::MulSub(s, turn, hn::Mul(d0, rest))), over_n,
                                           hn::Mul(hn::Mul(curve, turn), over_den)));
    const V r_s = hn::NegMulAdd(rise, hn::NegMulAdd(two, t, one), xi2);
    const V r_d0 = hn::NegMulAdd(rise, t, t), r_d1 = hn::Neg(hn::Mul(rise, t));
    const V r_xi = hn::Mul(hn::Mul(s, n), over_den);
    const V d_s = hn::MulAdd(d_l, l_s, hn::Mul(d_rise, r_s));
    const V d_d0 = hn::MulAdd(d_l, l_d0, hn::Mul(d_rise, r_d0)), d_d1 = hn::MulAdd(d_l, l_d1, hn::Mul(d_rise, r_d1));
    const V d_xi = hn::MulAdd(d_l, l_xi, hn::Mul(d_rise, r_xi));

    const V d_y = hn::Mul(d_xi, over_w);
    hn::Store(d_y, d, d_out + i);
    BinGradient g;
    g.y0 = hn::Neg(d_y);
    g.w = hn::Neg(hn::Mul(over_w, hn::MulAdd(s, d_s, hn::Mul(xi, d_xi))));
    g.z0 = d_z;
    g.h = hn::MulAdd(d_z, rise, hn::Mul(d_s, over_w));
    g.h0 = hn::Mul(d_d0, SlopeBackward(bin.h0, d0));
    g.h1 = hn::Mul(d_d1, SlopeBackward(bin.h1, d1));
    BinBackward(bins, widths, heights, x, g, d_heads + i);
  }
}

void TakeLog(double* HWY_RESTRICT density, double* HWY_RESTRICT log_density) {
  for (int i = 0; i < kBlock; i += kDoubles) {
    hn::Store(hn::Add(hn::Load(dd, log_density + i), hn::Log(dd, hn::Load(dd, density + i))), dd, log_density + i);
    hn::Store(hn::Set(dd, 1.0), dd, density + i);
  }
}

}  // namespace warpath::spline::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace warpath::spline {

HWY_EXPORT(Narrow);
HWY_EXPORT(Encode);
HWY_EXPORT(EncodeBackward);
HWY_EXPORT(Squeeze);
HWY_EXPORT(Stretch);
HWY_EXPORT(SqueezeForTraining);
HWY_EXPORT(SqueezeBackward);
HWY_EXPORT(TakeLog);

void narrow(const double* u, float* v) { HWY_DYNAMIC_DISPATCH(Narrow)(u, v); }
void encode(int bins, const float* u, float* x) { HWY_DYNAMIC_DISPATCH(Encode)(bins, u, x); }
void encode_backward(int bins, const float* u, const float* d_x, float* d_u) {
  HWY_DYNAMIC_DISPATCH(EncodeBackward)(bins, u, d_x, d_u);
}
void squeeze(int bins, const float* heads, double* y, double* density) {
  HWY_DYNAMIC_DISPATCH(Squeeze)(bins, heads, y, density);
}
void stretch(int bins, const float* heads, double* z, double* density) {
  HWY_DYNAMIC_DISPATCH(Stretch)(bins, heads, z, density);
}
void squeeze_for_training(int bins, const float* heads, const float* y, float* z, double* log_q) {
  HWY_DYNAMIC_DISPATCH(SqueezeForTraining)(bins, heads, y, z, log_q);
}
void squeeze_backward(int bins, const float* heads, const float* y, const float* weight, float* d, float* d_heads) {
  HWY_DYNAMIC_DISPATCH(SqueezeBackward)(bins, heads, y, weight, d, d_heads);
}
void take_log(double* density, double* log_density) { HWY_DYNAMIC_DISPATCH(TakeLog)(density, log_density); }

}  // namespace warpath::spline
#endif  // HWY_ONCE
