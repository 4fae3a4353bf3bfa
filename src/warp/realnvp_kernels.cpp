#include "warp/realnvp_kernels.h"

#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "warp/realnvp_kernels.cpp"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// After highway.h, which it needs.
#include <hwy/contrib/math/math-inl.h>

#include "warp/exp2-inl.h"

HWY_BEFORE_NAMESPACE();
namespace warpath::realnvp::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;
constexpr D d;
constexpr int kLanes = hn::MaxLanes(D());
// Doubles, and as many floats.
using DD = hn::CappedTag<double, 8>;
using VD = hn::Vec<DD>;
constexpr DD dd;
constexpr hn::RebindToUnsigned<DD> du;
constexpr hn::Rebind<float, DD> df;
constexpr int kDoubles = hn::MaxLanes(DD());
using nn::kBlock;
using warpath::HWY_NAMESPACE::Exp2;
using warpath::HWY_NAMESPACE::Exp2OfFraction;

constexpr double kBelowOne = 0x1.fffffffffffffp-1;

void Logit(int rows, const double* HWY_RESTRICT z, float* HWY_RESTRICT v) {
  const auto one = hn::Set(dd, 1.0), tiny = hn::Set(dd, 1.3e-37), huge = hn::Set(dd, 0.8e37);
  for (int i = 0; i < rows * kBlock; i += kDoubles) {
    const auto x = hn::Load(dd, z + i);
    const auto odds = hn::Min(hn::Max(hn::Div(x, hn::Sub(one, x)), tiny), huge);
    hn::Store(hn::DemoteTo(df, odds), df, v + i);
  }
  for (int i = 0; i < rows * kBlock; i += kLanes) hn::Store(hn::Log(d, hn::Load(d, v + i)), d, v + i);
}

/// e^x for |x| <= 300, with the error of a float, which is that of x here.
HWY_INLINE VD Exp(VD x) {
  const VD log2_e = hn::Set(dd, std::numbers::log2e);
  // So large that its last bits are the whole part of x log2(e).
  const VD magic = hn::Set(dd, 0x1.8p52), shifted = hn::MulAdd(x, log2_e, magic);
  const VD fraction = hn::MulSub(x, log2_e, hn::Sub(shifted, magic));
  const VD p = hn::PromoteTo(dd, Exp2OfFraction(df, hn::DemoteTo(df, fraction)));
  return hn::BitCast(dd, hn::Add(hn::BitCast(du, p), hn::ShiftLeft<52>(hn::BitCast(du, shifted))));
}

/// The logarithm of a product of positive numbers: mantissas are multiplied, up to 2^1023, and exponents are added.
struct LogOfProduct {
  VD mantissa;
  hn::Vec<decltype(du)> exponent;
  HWY_INLINE void Multiply(VD x) {
    const auto bits = hn::BitCast(du, x), one = hn::BitCast(du, hn::Set(dd, 1.0));
    const auto fraction = hn::And(bits, hn::Set(du, 0xFFFFFFFFFFFFFu));
    mantissa = hn::Mul(mantissa, hn::BitCast(dd, hn::Or(fraction, one)));
    exponent = hn::Add(exponent, hn::Sub(hn::ShiftRight<52>(bits), hn::Set(du, 1023u)));
  }
  HWY_INLINE VD Log() const {
    const VD powers = hn::ConvertTo(dd, hn::BitCast(hn::RebindToSigned<DD>(), exponent));
    return hn::MulAdd(powers, hn::Set(dd, std::numbers::ln2), hn::Log(dd, mantissa));
  }
};

void ShiftLogit(int rows, const double* z, const float* HWY_RESTRICT v0, const float* HWY_RESTRICT v1, double* y,
                double* HWY_RESTRICT log_det) {
  const VD one = hn::Set(dd, 1.0), limit = hn::Set(dd, 300.0);
  for (int column = 0; column < kBlock; column += kDoubles) {
    LogOfProduct sums{one, hn::Zero(du)};
    VD log_slope = hn::Load(dd, log_det + column);
    for (int i = column; i < rows * kBlock; i += kBlock) {
      const VD from = hn::PromoteTo(dd, hn::Load(df, v0 + i)), to = hn::PromoteTo(dd, hn::Load(df, v1 + i));
      const VD back = hn::Max(hn::Min(hn::Sub(from, to), limit), hn::Neg(limit));
      const VD x = hn::Load(dd, z + i);
      const VD sum = hn::MulAdd(hn::Sub(one, x), Exp(back), x);
      hn::Store(hn::Min(hn::Div(x, sum), hn::Set(dd, kBelowOne)), dd, y + i);
      sums.Multiply(sum);
      log_slope = hn::Add(log_slope, back);
    }
    hn::Store(hn::NegMulAdd(hn::Set(dd, 2.0), sums.Log(), log_slope), dd, log_det + column);
  }
}

HWY_INLINE V Clip(V v) { return hn::Max(hn::Min(v, hn::Set(d, kEdge)), hn::Set(d, -kEdge)); }
HWY_INLINE V Sigmoid(V v) {
  const V one = hn::Set(d, 1.0f);
  return hn::Div(one, hn::Add(one, hn::Exp(d, hn::Neg(v))));
}

/// Absolute error 1e-7, which is what counts here; highway's has that relative error and takes twice as long.
HWY_INLINE V Tanh(V v) {
  const V one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f), most = hn::Set(d, 30.0f);
  const V log2_odds = hn::Mul(hn::Max(hn::Min(v, most), hn::Neg(most)), hn::Set(d, 2 * std::numbers::log2e_v<float>));
  return hn::Sub(one, hn::Div(two, hn::Add(Exp2(d, log2_odds), one)));
}

/// The row's scale in octaves, so that slope and density are one number.
HWY_INLINE V Octaves(float a) {
  return hn::Set(d, HWY_MAX(-126.0f, HWY_MIN(a * std::numbers::log2e_v<float>, 126.0f)));
}

void Encode(int bins, const float* HWY_RESTRICT v, float* HWY_RESTRICT x) {
  const V one = hn::Set(d, 1.0f), scale = hn::Set(d, 1 / kBlobRadius);
  for (int i = 0; i < kBlock; i += kLanes) {
    const V clipped = Clip(hn::Load(d, v + i));
    hn::Store(clipped, d, x + i);
    if (bins == 0) continue;
    V t = hn::Mul(hn::MulSub(Sigmoid(clipped), hn::Set(d, static_cast<float>(bins)), hn::Set(d, 0.5f)), scale);
    for (int k = 1; k <= bins; ++k, t = hn::Sub(t, scale)) {
      const V hat = hn::Max(hn::NegMulAdd(t, t, one), hn::Zero(d));
      hn::Store(hn::Mul(hat, hat), d, x + k * kBlock + i);
    }
  }
}

void EncodeBackward(int bins, const float* HWY_RESTRICT v, const float* HWY_RESTRICT d_x, float* HWY_RESTRICT d_v) {
  const V one = hn::Set(d, 1.0f), scale = hn::Set(d, 1 / kBlobRadius);
  for (int i = 0; i < kBlock; i += kLanes) {
    const V x = hn::Load(d, v + i);
    V sum = hn::Load(d, d_x + i);
    if (bins > 0) {
      const V u = Sigmoid(Clip(x));
      V t = hn::Mul(hn::MulSub(u, hn::Set(d, static_cast<float>(bins)), hn::Set(d, 0.5f)), scale);
      V d_t = hn::Zero(d);
      for (int k = 1; k <= bins; ++k, t = hn::Sub(t, scale)) {
        const V hat = hn::Max(hn::NegMulAdd(t, t, one), hn::Zero(d));
        d_t = hn::MulAdd(hn::Mul(hat, t), hn::Load(d, d_x + k * kBlock + i), d_t);
      }
      const V du_dv = hn::Mul(u, hn::Sub(one, u));
      sum = hn::MulAdd(hn::Mul(d_t, du_dv), hn::Set(d, -4.0f * static_cast<float>(bins) / kBlobRadius), sum);
    }
    const V inside = hn::IfThenElseZero(hn::Le(hn::Abs(x), hn::Set(d, kEdge)), sum);
    hn::Store(hn::Add(hn::Load(d, d_v + i), inside), d, d_v + i);
  }
}

/// sums += unit * terms
HWY_INLINE void AddDoubles(double unit, const float* HWY_RESTRICT terms, double* HWY_RESTRICT sums) {
  for (int i = 0; i < kBlock; i += kDoubles) {
    const VD term = hn::PromoteTo(dd, hn::Load(df, terms + i));
    hn::Store(hn::MulAdd(term, hn::Set(dd, unit), hn::Load(dd, sums + i)), dd, sums + i);
  }
}

struct Moved {
  V to;
  hn::Mask<D> inside;  // where it is scaled
};
struct Forward {
  HWY_INLINE Moved operator()(V x, V e, V t) const {
    const V edge = hn::Set(d, kEdge);
    const auto inside = hn::Le(hn::Abs(x), edge);
    const V beyond = hn::MulAdd(hn::CopySign(edge, x), hn::Sub(e, hn::Set(d, 1.0f)), hn::Add(x, t));
    return {hn::IfThenElse(inside, hn::MulAdd(x, e, t), beyond), inside};
  }
};
struct Backward {
  HWY_INLINE Moved operator()(V v, V e, V t) const {
    const V edge = hn::Set(d, kEdge), x = hn::Sub(v, t);
    const auto inside = hn::Le(hn::Abs(x), hn::Mul(edge, e));
    const V beyond = hn::NegMulAdd(hn::CopySign(edge, x), hn::Sub(e, hn::Set(d, 1.0f)), x);
    return {hn::IfThenElse(inside, hn::Div(x, e), beyond), inside};
  }
};

/// log_det += sign * s of all rows.
template <class Direction>
HWY_INLINE void MoveRows(Direction direction, double sign, int moved, const int* HWY_RESTRICT rows,
                         const float* HWY_RESTRICT a, const float* HWY_RESTRICT heads, float* HWY_RESTRICT v,
                         double* HWY_RESTRICT log_det) {
  HWY_ALIGN float octaves[kBlock] = {};
  const float* HWY_RESTRICT h_t = heads + moved * kBlock;
  for (int k = 0; k < moved; ++k, heads += kBlock, h_t += kBlock) {
    const V scale = Octaves(a[k]);
    float* HWY_RESTRICT row = v + rows[k] * kBlock;
    for (int i = 0; i < kBlock; i += kLanes) {
      const V s = hn::Mul(scale, Tanh(hn::Load(d, heads + i)));
      const Moved now = direction(hn::Load(d, row + i), Exp2(d, s), hn::Load(d, h_t + i));
      hn::Store(now.to, d, row + i);
      hn::Store(hn::Add(hn::Load(d, octaves + i), hn::IfThenElseZero(now.inside, s)), d, octaves + i);
    }
  }
  AddDoubles(sign * std::numbers::ln2, octaves, log_det);
}

void Couple(int moved, const int* rows, const float* a, const float* heads, float* v, double* log_det) {
  MoveRows(Forward{}, 1, moved, rows, a, heads, v, log_det);
}
void Uncouple(int moved, const int* rows, const float* a, const float* heads, float* v, double* log_det) {
  MoveRows(Backward{}, -1, moved, rows, a, heads, v, log_det);
}

float UncoupleBackward(float a, const float* HWY_RESTRICT h_s, const float* HWY_RESTRICT h_t,
                       const float* HWY_RESTRICT weight, const float* HWY_RESTRICT v, float* HWY_RESTRICT d_v,
                       float* HWY_RESTRICT d_h_s, float* HWY_RESTRICT d_h_t) {
  const V scale = hn::Set(d, a), octaves = Octaves(a), edge = hn::Set(d, kEdge), one = hn::Set(d, 1.0f);
  V d_scale = hn::Zero(d);
  for (int i = 0; i < kBlock; i += kLanes) {
    const V tanh = Tanh(hn::Load(d, h_s + i));
    const V e = Exp2(d, hn::Mul(octaves, tanh)), x = hn::Sub(hn::Load(d, v + i), hn::Load(d, h_t + i));
    const auto inside = hn::Le(hn::Abs(x), hn::Mul(edge, e));
    // u = x e^-s inside; x -+ edge (e^s - 1) beyond.
    const V du_dx = hn::IfThenElse(inside, hn::Div(one, e), one);
    const V du_ds = hn::Neg(hn::IfThenElse(inside, hn::Div(x, e), hn::Mul(hn::CopySign(edge, x), e)));
    const V d_u = hn::Load(d, d_v + i);
    const V d_x = hn::Mul(d_u, du_dx);
    const V d_s = hn::MulAdd(d_u, du_ds, hn::IfThenElseZero(inside, hn::Load(d, weight + i)));
    hn::Store(d_x, d, d_v + i);
    hn::Store(hn::Neg(d_x), d, d_h_t + i);
    hn::Store(hn::Mul(hn::Mul(d_s, scale), hn::NegMulAdd(tanh, tanh, one)), d, d_h_s + i);
    d_scale = hn::MulAdd(d_s, tanh, d_scale);
  }
  return hn::GetLane(hn::SumOfLanes(d, d_scale));
}

void AddLogLogistic(int rows, const float* HWY_RESTRICT v, bool minus, double* HWY_RESTRICT log_q) {
  HWY_ALIGN float terms[kBlock];
  const V two = hn::Set(d, 2.0f);
  for (int column = 0; column < kBlock; column += kLanes) {
    V sum = hn::Zero(d);
    for (int i = column; i < rows * kBlock; i += kBlock) {
      const V abs = hn::Abs(hn::Load(d, v + i));
      sum = hn::Sub(sum, hn::MulAdd(two, hn::Log1p(d, hn::Exp(d, hn::Neg(abs))), abs));
    }
    hn::Store(sum, d, terms + column);
  }
  AddDoubles(minus ? -1 : 1, terms, log_q);
}

void LogLogisticGradient(int rows, const float* HWY_RESTRICT weight, const float* HWY_RESTRICT v,
                         float* HWY_RESTRICT d_v) {
  const V half = hn::Set(d, 0.5f);
  for (int i = 0; i < rows * kBlock; i += kLanes)
    hn::Store(hn::Mul(hn::Load(d, weight + i % kBlock), Tanh(hn::Mul(half, hn::Load(d, v + i)))), d, d_v + i);
}

}  // namespace warpath::realnvp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace warpath::realnvp {

HWY_EXPORT(Logit);
HWY_EXPORT(ShiftLogit);
HWY_EXPORT(Encode);
HWY_EXPORT(EncodeBackward);
HWY_EXPORT(Couple);
HWY_EXPORT(Uncouple);
HWY_EXPORT(UncoupleBackward);
HWY_EXPORT(AddLogLogistic);
HWY_EXPORT(LogLogisticGradient);

void logit(int rows, const double* z, float* v) { HWY_DYNAMIC_DISPATCH(Logit)(rows, z, v); }
void shift_logit(int rows, const double* z, const float* v0, const float* v1, double* y, double* log_det) {
  HWY_DYNAMIC_DISPATCH(ShiftLogit)(rows, z, v0, v1, y, log_det);
}
void encode(int bins, const float* v, float* x) { HWY_DYNAMIC_DISPATCH(Encode)(bins, v, x); }
void encode_backward(int bins, const float* v, const float* d_x, float* d_v) {
  HWY_DYNAMIC_DISPATCH(EncodeBackward)(bins, v, d_x, d_v);
}
void couple(std::span<const int> moved, const float* a, const float* heads, float* v, double* log_det) {
  HWY_DYNAMIC_DISPATCH(Couple)(static_cast<int>(moved.size()), moved.data(), a, heads, v, log_det);
}
void uncouple(std::span<const int> moved, const float* a, const float* heads, float* v, double* log_det) {
  HWY_DYNAMIC_DISPATCH(Uncouple)(static_cast<int>(moved.size()), moved.data(), a, heads, v, log_det);
}
float uncouple_backward(float a, const float* h_s, const float* h_t, const float* weight, const float* v, float* d_v,
                        float* d_h_s, float* d_h_t) {
  return HWY_DYNAMIC_DISPATCH(UncoupleBackward)(a, h_s, h_t, weight, v, d_v, d_h_s, d_h_t);
}
void add_log_logistic(int rows, const float* v, bool minus, double* log_q) {
  HWY_DYNAMIC_DISPATCH(AddLogLogistic)(rows, v, minus, log_q);
}
void log_logistic_gradient(int rows, const float* weight, const float* v, float* d_v) {
  HWY_DYNAMIC_DISPATCH(LogLogisticGradient)(rows, weight, v, d_v);
}

}  // namespace warpath::realnvp
#endif  // HWY_ONCE
