// Vectors of many lanes, and the maps of sample_square_to_hemisphere.h and frame.h on them. Included once for each
// instruction set, after <hwy/highway.h>.
#if defined(WARPATH_TRACER_SIMD_MATH) == defined(HWY_TARGET_TOGGLE)
#ifdef WARPATH_TRACER_SIMD_MATH
#undef WARPATH_TRACER_SIMD_MATH
#else
#define WARPATH_TRACER_SIMD_MATH
#endif

#include <hwy/highway.h>

#include "tracer/vec3_array.h"

HWY_BEFORE_NAMESPACE();
namespace warpath::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;
constexpr D d;
constexpr hn::RebindToSigned<D> di;

HWY_INLINE V One() { return hn::Set(d, 1.0f); }

struct V3 {
  V x, y, z;
};
HWY_INLINE V3 Load(const Vec3Array& a, std::size_t i) {
  return {hn::LoadU(d, a.x + i), hn::LoadU(d, a.y + i), hn::LoadU(d, a.z + i)};
}
HWY_INLINE void Store(const V3& v, const Vec3Array& a, std::size_t i) {
  hn::StoreU(v.x, d, a.x + i);
  hn::StoreU(v.y, d, a.y + i);
  hn::StoreU(v.z, d, a.z + i);
}
HWY_INLINE V3 Set(const Vec3& v) { return {hn::Set(d, v.x), hn::Set(d, v.y), hn::Set(d, v.z)}; }
HWY_INLINE V3 operator+(const V3& a, const V3& b) { return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)}; }
HWY_INLINE V3 operator-(const V3& a, const V3& b) { return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)}; }
HWY_INLINE V3 operator*(const V3& a, V s) { return {hn::Mul(a.x, s), hn::Mul(a.y, s), hn::Mul(a.z, s)}; }
/// a s + b
HWY_INLINE V3 MulAdd(const V3& a, V s, const V3& b) {
  return {hn::MulAdd(a.x, s, b.x), hn::MulAdd(a.y, s, b.y), hn::MulAdd(a.z, s, b.z)};
}
HWY_INLINE V Dot(const V3& a, const V3& b) { return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z))); }
HWY_INLINE V3 Cross(const V3& a, const V3& b) {
  return {hn::MulSub(a.y, b.z, hn::Mul(a.z, b.y)), hn::MulSub(a.z, b.x, hn::Mul(a.x, b.z)),
          hn::MulSub(a.x, b.y, hn::Mul(a.y, b.x))};
}
HWY_INLINE V3 Unit(const V3& v) { return v * hn::Div(One(), hn::Sqrt(Dot(v, v))); }
template <class M>
HWY_INLINE V3 IfThenElse(M m, const V3& a, const V3& b) {
  return {hn::IfThenElse(m, a.x, b.x), hn::IfThenElse(m, a.y, b.y), hn::IfThenElse(m, a.z, b.z)};
}
template <class M>
HWY_INLINE V3 IfThenElseZero(M m, const V3& a) {
  return {hn::IfThenElseZero(m, a.x), hn::IfThenElseZero(m, a.y), hn::IfThenElseZero(m, a.z)};
}

/// square_to_disk
HWY_INLINE void SquareToDisk(V u0, V u1, V& disk_x, V& disk_y) {
  const V two = hn::Set(d, 2.0f), x = hn::MulSub(two, u0, One()), y = hn::MulSub(two, u1, One());
  const auto steep = hn::Lt(hn::Abs(x), hn::Abs(y));
  const V r = hn::IfThenElse(steep, y, x), other = hn::IfThenElse(steep, x, y);
  const V ratio = hn::IfThenZeroElse(hn::Eq(r, hn::Zero(d)), hn::Div(other, r));
  const V phi = hn::Mul(ratio, hn::Set(d, 0.25f * kPi)), z = hn::Mul(phi, phi);
  // [Cephes, sinf.c and cosf.c]
  V s = hn::MulAdd(z, hn::Set(d, -1.9515295891e-4f), hn::Set(d, 8.3321608736e-3f));
  s = hn::MulAdd(z, s, hn::Set(d, -1.6666654611e-1f));
  s = hn::MulAdd(hn::Mul(s, z), phi, phi);
  V c = hn::MulAdd(z, hn::Set(d, 2.443315711809948e-5f), hn::Set(d, -1.388731625493765e-3f));
  c = hn::MulAdd(z, c, hn::Set(d, 4.166664568298827e-2f));
  c = hn::MulAdd(hn::Mul(c, z), z, hn::NegMulAdd(z, hn::Set(d, 0.5f), One()));
  const V along = hn::Mul(r, c), across = hn::Mul(r, s);
  disk_x = hn::IfThenElse(steep, across, along);
  disk_y = hn::IfThenElse(steep, along, across);
}

/// x s + y t of the frame_of_normal of n.
HWY_INLINE V3 InFrameOfNormal(const V3& n, V x, V y) {
  const V3 pole = Set({0.36f, 0.48f, 0.8f}), e1 = Set({0.8f, -0.6f, 0.0f}), e2 = Set({0.48f, 0.64f, -0.6f});
  V3 h = n + pole;
  V hh = Dot(h, h);
  const auto near_pole = hn::Lt(hh, hn::Set(d, 1e-4f));
  if (!hn::AllFalse(d, near_pole)) {
    h = IfThenElse(near_pole, n - pole, h);
    hh = Dot(h, h);
    y = hn::IfThenElse(near_pole, hn::Neg(y), y);
  }
  const V k = hn::Div(hn::Set(d, -2.0f), hh);
  // The reflection of x e1 + y e2.
  const V along_h = hn::MulAdd(Dot(h, e1), x, hn::Mul(Dot(h, e2), y));
  return MulAdd(h, hn::Mul(k, along_h), MulAdd(e1, x, e2 * y));
}

/// square_to_cosine_hemisphere around n, and the cosine to it.
HWY_INLINE V3 CosineHemisphere(const V3& n, V u0, V u1, V& cosine) {
  V x, y;
  SquareToDisk(u0, u1, x, y);
  cosine = hn::Sqrt(hn::Max(hn::Zero(d), hn::NegMulAdd(x, x, hn::NegMulAdd(y, y, One()))));
  return MulAdd(n, cosine, InFrameOfNormal(n, x, y));
}

}  // namespace warpath::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // WARPATH_TRACER_SIMD_MATH
