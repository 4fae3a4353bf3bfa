// 2^x for the warps' kernels. Included once for each instruction set, after <hwy/highway.h>.
#if defined(WARPATH_WARP_EXP2) == defined(HWY_TARGET_TOGGLE)
#ifdef WARPATH_WARP_EXP2
#undef WARPATH_WARP_EXP2
#else
#define WARPATH_WARP_EXP2
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace warpath::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// 2^f for |f| <= 1/2: relative error 8e-8, and exactly 1 at 0. The polynomial of degree 6 with that constant whose
/// largest relative error is the least, found by reweighted least squares.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Exp2OfFraction(D d, V f) {
  V p = hn::Set(d, 1.53533620e-4f);
  p = hn::MulAdd(p, f, hn::Set(d, 1.33988750e-3f));
  p = hn::MulAdd(p, f, hn::Set(d, 9.61843692e-3f));
  p = hn::MulAdd(p, f, hn::Set(d, 5.55033237e-2f));
  p = hn::MulAdd(p, f, hn::Set(d, 2.40226477e-1f));
  p = hn::MulAdd(p, f, hn::Set(d, 6.93147182e-1f));
  return hn::MulAdd(p, f, hn::Set(d, 1.0f));
}

/// 2^x for -126 <= x <= 126.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Exp2(D d, V x) {
  const hn::RebindToSigned<D> di;
  const V whole = hn::Round(x);
  const V p = Exp2OfFraction(d, hn::Sub(x, whole));
  // Times 2^whole: added to the exponent.
  return hn::BitCast(d, hn::Add(hn::BitCast(di, p), hn::ShiftLeft<23>(hn::ConvertTo(di, whole))));
}

}  // namespace warpath::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per instruction set
