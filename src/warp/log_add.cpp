#include "warp/log_add.h"

#include <algorithm>
#include <array>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "warp/log_add.cpp"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// After highway.h, which it needs.
#include <hwy/contrib/math/math-inl.h>

HWY_BEFORE_NAMESPACE();
namespace warpath::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<double, 8>;
constexpr D d;
constexpr std::size_t kLanes = hn::MaxLanes(D());

HWY_INLINE hn::Vec<D> LogAdd(hn::Vec<D> a, hn::Vec<D> b) {
  const auto high = hn::Max(a, b);
  // e^-1000 is 0; the difference of two infinities is none.
  const auto difference = hn::Max(hn::Sub(hn::Min(a, b), high), hn::Set(d, -1000.0));
  const auto sum = hn::Add(high, hn::Log1p(d, hn::Exp(d, difference)));
  return hn::IfThenElse(hn::Lt(high, hn::Set(d, -1e300)), high, sum);
}

void LogAddRows(std::size_t n, double* HWY_RESTRICT a, const double* HWY_RESTRICT b, double shift) {
  const auto by = hn::Set(d, shift);
  std::size_t i = 0;
  for (; i + kLanes <= n; i += kLanes)
    hn::StoreU(LogAdd(hn::LoadU(d, a + i), hn::Add(hn::LoadU(d, b + i), by)), d, a + i);
  if (i == n) return;
  // The last ones go the same way, so that a row does not depend on its place.
  std::array<double, kLanes> rest_a{}, rest_b{};
  std::copy_n(a + i, n - i, rest_a.begin());
  std::copy_n(b + i, n - i, rest_b.begin());
  hn::StoreU(LogAdd(hn::LoadU(d, rest_a.data()), hn::Add(hn::LoadU(d, rest_b.data()), by)), d, rest_a.data());
  std::copy_n(rest_a.begin(), n - i, a + i);
}

}  // namespace warpath::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace warpath {

HWY_EXPORT(LogAddRows);

void log_add(std::size_t n, double* a, const double* b, double shift) {
  HWY_DYNAMIC_DISPATCH(LogAddRows)(n, a, b, shift);
}

}  // namespace warpath
#endif  // HWY_ONCE
