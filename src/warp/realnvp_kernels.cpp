#include "warp/realnvp_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "warp/realnvp_kernels.cpp"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// After highway.h, which it needs.
#include <hwy/contrib/math/math-inl.h>

HWY_BEFORE_NAMESPACE();
namespace warpath::realnvp::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;
constexpr D d;
constexpr int kLanes = hn::MaxLanes(D());
// Doubles, and as many floats.
using DD = hn::CappedTag<double, 8>;
constexpr DD dd;
constexpr hn::Rebind<float, DD> df;
constexpr int kDoubles = hn::MaxLanes(DD());
using nn::kBlock;

constexpr double kBelowOne = 0x1.fffffffffffffp-1;

void Logit(const double* HWY_RESTRICT z, float* HWY_RESTRICT v) {
  const auto one = hn::Set(dd, 1.0), tiny = hn::Set(dd, 1.3e-37), huge = hn::Set(dd, 0.8e37);
  for (int i = 0; i < kBlock; i += kDoubles) {
    const auto x = hn::Load(dd, z + i);
    const auto odds = hn::Min(hn::Max(hn::Div(x, hn::Sub(one, x)), tiny), huge);
    hn::Store(hn::DemoteTo(df, odds), df, v + i);
  }
  for (int i = 0; i < kBlock; i += kLanes) hn::Store(hn::Log(d, hn::Load(d, v + i)), d, v + i);
}

void ShiftLogit(const double* z, const float* HWY_RESTRICT v0, const float* HWY_RESTRICT v1, double* y,
                double* HWY_RESTRICT log_det) {
  const auto one = hn::Set(dd, 1.0), limit = hn::Set(dd, 300.0);
  for (int i = 0; i < kBlock; i += kDoubles) {
    const auto from = hn::PromoteTo(dd, hn::Load(df, v0 + i)), to = hn::PromoteTo(dd, hn::Load(df, v1 + i));
    const auto back = hn::Max(hn::Min(hn::Sub(from, to), limit), hn::Neg(limit));
    const auto x = hn::Load(dd, z + i);
    const auto sum = hn::MulAdd(hn::Sub(one, x), hn::Exp(dd, back), x);
    hn::Store(hn::Min(hn::Div(x, sum), hn::Set(dd, kBelowOne)), dd, y + i);
    const auto slope = hn::NegMulAdd(hn::Set(dd, 2.0), hn::Log(dd, sum), back);
    hn::Store(hn::Add(hn::Load(dd, log_det + i), slope), dd, log_det + i);
  }
}

HWY_INLINE V Clip(V v) { return hn::Max(hn::Min(v, hn::Set(d, kEdge)), hn::Set(d, -kEdge)); }
HWY_INLINE V Sigmoid(V v) {
  const V one = hn::Set(d, 1.0f);
  return hn::Div(one, hn::Add(one, hn::Exp(d, hn::Neg(v))));
}

/// Absolute error 1e-7, which is what counts here; highway's has that relative error and takes twice as long.
HWY_INLINE V Tanh(V v) {
  const V one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f);
  const V odds = hn::Exp(d, hn::Min(hn::Add(v, v), hn::Set(d, 80.0f)));
  return hn::Sub(one, hn::Div(two, hn::Add(odds, one)));
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

HWY_INLINE void AddDoubles(const float* HWY_RESTRICT terms, double* HWY_RESTRICT sums) {
  for (int i = 0; i < kBlock; i += kDoubles)
    hn::Store(hn::Add(hn::Load(dd, sums + i), hn::PromoteTo(dd, hn::Load(df, terms + i))), dd, sums + i);
}

void Couple(float a, const float* HWY_RESTRICT h_s, const float* HWY_RESTRICT h_t, float* HWY_RESTRICT v,
            double* HWY_RESTRICT log_det) {
  HWY_ALIGN float terms[kBlock];
  const V scale = hn::Set(d, a), edge = hn::Set(d, kEdge), one = hn::Set(d, 1.0f);
  for (int i = 0; i < kBlock; i += kLanes) {
    const V s = hn::Mul(scale, Tanh(hn::Load(d, h_s + i)));
    const V e = hn::Exp(d, s), t = hn::Load(d, h_t + i), x = hn::Load(d, v + i);
    const auto inside = hn::Le(hn::Abs(x), edge);
    const V beyond = hn::MulAdd(hn::CopySign(edge, x), hn::Sub(e, one), hn::Add(x, t));
    hn::Store(hn::IfThenElse(inside, hn::MulAdd(x, e, t), beyond), d, v + i);
    hn::Store(hn::IfThenElseZero(inside, s), d, terms + i);
  }
  AddDoubles(terms, log_det);
}

void Uncouple(float a, const float* HWY_RESTRICT h_s, const float* HWY_RESTRICT h_t, float* HWY_RESTRICT v,
              double* HWY_RESTRICT log_det) {
  HWY_ALIGN float terms[kBlock];
  const V scale = hn::Set(d, a), edge = hn::Set(d, kEdge), one = hn::Set(d, 1.0f);
  for (int i = 0; i < kBlock; i += kLanes) {
    const V s = hn::Mul(scale, Tanh(hn::Load(d, h_s + i)));
    const V e = hn::Exp(d, s), x = hn::Sub(hn::Load(d, v + i), hn::Load(d, h_t + i));
    const auto inside = hn::Le(hn::Abs(x), hn::Mul(edge, e));
    const V beyond = hn::NegMulAdd(hn::CopySign(edge, x), hn::Sub(e, one), x);
    hn::Store(hn::IfThenElse(inside, hn::Div(x, e), beyond), d, v + i);
    hn::Store(hn::IfThenElseZero(inside, hn::Neg(s)), d, terms + i);
  }
  AddDoubles(terms, log_det);
}

float UncoupleBackward(float a, const float* HWY_RESTRICT h_s, const float* HWY_RESTRICT h_t,
                       const float* HWY_RESTRICT weight, const float* HWY_RESTRICT v, float* HWY_RESTRICT d_v,
                       float* HWY_RESTRICT d_h_s, float* HWY_RESTRICT d_h_t) {
  const V scale = hn::Set(d, a), edge = hn::Set(d, kEdge), one = hn::Set(d, 1.0f);
  V d_scale = hn::Zero(d);
  for (int i = 0; i < kBlock; i += kLanes) {
    const V tanh = Tanh(hn::Load(d, h_s + i));
    const V e = hn::Exp(d, hn::Mul(scale, tanh)), x = hn::Sub(hn::Load(d, v + i), hn::Load(d, h_t + i));
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

void AddLogLogistic(const float* HWY_RESTRICT v, bool minus, double* HWY_RESTRICT log_q) {
  HWY_ALIGN float terms[kBlock];
  const V two = hn::Set(d, minus ? -2.0f : 2.0f), sign = hn::Set(d, minus ? -1.0f : 1.0f);
  for (int i = 0; i < kBlock; i += kLanes) {
    const V abs = hn::Abs(hn::Load(d, v + i));
    const V log = hn::Log1p(d, hn::Exp(d, hn::Neg(abs)));
    hn::Store(hn::Neg(hn::MulAdd(two, log, hn::Mul(sign, abs))), d, terms + i);
  }
  AddDoubles(terms, log_q);
}

void LogLogisticGradient(const float* HWY_RESTRICT weight, const float* HWY_RESTRICT v, float* HWY_RESTRICT d_v) {
  const V half = hn::Set(d, 0.5f);
  for (int i = 0; i < kBlock; i += kLanes)
    hn::Store(hn::Mul(hn::Load(d, weight + i), Tanh(hn::Mul(half, hn::Load(d, v + i)))), d, d_v + i);
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

void logit(const double* z, float* v) { HWY_DYNAMIC_DISPATCH(Logit)(z, v); }
void shift_logit(const double* z, const float* v0, const float* v1, double* y, double* log_det) {
  HWY_DYNAMIC_DISPATCH(ShiftLogit)(z, v0, v1, y, log_det);
}
void encode(int bins, const float* v, float* x) { HWY_DYNAMIC_DISPATCH(Encode)(bins, v, x); }
void encode_backward(int bins, const float* v, const float* d_x, float* d_v) {
  HWY_DYNAMIC_DISPATCH(EncodeBackward)(bins, v, d_x, d_v);
}
void couple(float a, const float* h_s, const float* h_t, float* v, double* log_det) {
  HWY_DYNAMIC_DISPATCH(Couple)(a, h_s, h_t, v, log_det);
}
void uncouple(float a, const float* h_s, const float* h_t, float* v, double* log_det) {
  HWY_DYNAMIC_DISPATCH(Uncouple)(a, h_s, h_t, v, log_det);
}
float uncouple_backward(float a, const float* h_s, const float* h_t, const float* weight, const float* v, float* d_v,
                        float* d_h_s, float* d_h_t) {
  return HWY_DYNAMIC_DISPATCH(UncoupleBackward)(a, h_s, h_t, weight, v, d_v, d_h_s, d_h_t);
}
void add_log_logistic(const float* v, bool minus, double* log_q) {
  HWY_DYNAMIC_DISPATCH(AddLogLogistic)(v, minus, log_q);
}
void log_logistic_gradient(const float* weight, const float* v, float* d_v) {
  HWY_DYNAMIC_DISPATCH(LogLogisticGradient)(weight, v, d_v);
}

}  // namespace warpath::realnvp
#endif  // HWY_ONCE
