#include "nn/adam.h"

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nn/adam.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace warpath::nn::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;
constexpr D d;
constexpr std::size_t kLanes = hn::MaxLanes(D());

void AdamStep(const Adam& adam, int step, std::size_t count, const float* HWY_RESTRICT gradient,
              float* HWY_RESTRICT parameter, float* HWY_RESTRICT m, float* HWY_RESTRICT v) {
  // m^ = m / (1 - beta1^t) and v^ likewise: both corrections are folded into the rate and epsilon.
  const double correct1 = 1 - std::pow(static_cast<double>(adam.beta1), step);
  const double correct2 = std::sqrt(1 - std::pow(static_cast<double>(adam.beta2), step));
  const V rate = hn::Set(d, static_cast<float>(-adam.rate * correct2 / correct1));
  const V epsilon = hn::Set(d, static_cast<float>(adam.epsilon * correct2));
  const V beta1 = hn::Set(d, adam.beta1), rest1 = hn::Set(d, 1 - adam.beta1);
  const V beta2 = hn::Set(d, adam.beta2), rest2 = hn::Set(d, 1 - adam.beta2);
  for (std::size_t i = 0; i < count; i += kLanes) {
    const V g = hn::Load(d, gradient + i);
    const V m1 = hn::MulAdd(beta1, hn::Load(d, m + i), hn::Mul(rest1, g));
    const V v1 = hn::MulAdd(beta2, hn::Load(d, v + i), hn::Mul(rest2, hn::Mul(g, g)));
    hn::Store(m1, d, m + i);
    hn::Store(v1, d, v + i);
    const V change = hn::Div(m1, hn::Add(hn::Sqrt(v1), epsilon));
    hn::Store(hn::MulAdd(rate, change, hn::Load(d, parameter + i)), d, parameter + i);
  }
}

void AddSlots(int slots, std::size_t stride, std::size_t count, float* HWY_RESTRICT a) {
  for (std::size_t i = 0; i < count; i += kLanes) {
    V sum = hn::Load(d, a + i);
    for (int slot = 1; slot < slots; ++slot)
      sum = hn::Add(sum, hn::Load(d, a + static_cast<std::size_t>(slot) * stride + i));
    hn::Store(sum, d, a + i);
  }
}

void MoveAverage(float weight, std::size_t count, const float* HWY_RESTRICT parameter, float* HWY_RESTRICT average) {
  const V w = hn::Set(d, weight);
  for (std::size_t i = 0; i < count; i += kLanes) {
    const V a = hn::Load(d, average + i);
    hn::Store(hn::MulAdd(w, hn::Sub(hn::Load(d, parameter + i), a), a), d, average + i);
  }
}

}  // namespace warpath::nn::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace warpath::nn {

HWY_EXPORT(AdamStep);
HWY_EXPORT(AddSlots);
HWY_EXPORT(MoveAverage);

void adam_step(const Adam& adam, int step, std::size_t count, const float* gradient, float* parameter, float* m,
               float* v) {
  HWY_DYNAMIC_DISPATCH(AdamStep)(adam, step, count, gradient, parameter, m, v);
}

void add_slots(int slots, std::size_t stride, std::size_t count, float* a) {
  HWY_DYNAMIC_DISPATCH(AddSlots)(slots, stride, count, a);
}

void move_average(float weight, std::size_t count, const float* parameter, float* average) {
  HWY_DYNAMIC_DISPATCH(MoveAverage)(weight, count, parameter, average);
}

}  // namespace warpath::nn
#endif  // HWY_ONCE
