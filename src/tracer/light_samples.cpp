#include "tracer/light_samples.h"

#include <limits>

#include "tracer/surface.h"
#include "warpath/error.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tracer/light_samples.cpp"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// After highway.h, which it needs.
#include "tracer/simd_math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace warpath::HWY_NAMESPACE {

/// Entries of a table by index: from registers if they fit in one.
class Lookup {
 public:
  HWY_INLINE Lookup(const RectangleLights& lights, hn::Vec<decltype(di)> index)
      : m_lights(lights),
        m_index(index),
        m_small(lights.size() <= hn::Lanes(d)),
        m_lanes(hn::IndicesFromVec(d, hn::And(index, hn::Set(di, static_cast<int>(hn::Lanes(d)) - 1)))) {}

  HWY_INLINE V operator()(int column) const {
    const float* table = m_lights.column(column);
    return m_small ? hn::TableLookupLanes(hn::Load(d, table), m_lanes) : hn::GatherIndex(d, table, m_index);
  }
  HWY_INLINE V3 Vector(int column) const { return {(*this)(column), (*this)(column + 1), (*this)(column + 2)}; }

 private:
  const RectangleLights& m_lights;
  const hn::Vec<decltype(di)> m_index;
  const bool m_small;
  const decltype(hn::IndicesFromVec(d, hn::Zero(di))) m_lanes;
};

void SampleRectangles(const RectangleLights& lights, std::size_t n, const Vec3Array& from, const float* choice,
                      const float* u, const float* v, const LightSamples& samples) {
  using Column = RectangleLights::Column;
  const V zero = hn::Zero(d);
  const float* begins = lights.column(Column::choice_begin);
  for (std::size_t k = 0; k < n; k += hn::Lanes(d)) {
    auto index = hn::Zero(di);
    if (choice) {
      const V c = hn::LoadU(d, choice + k);
      for (std::size_t i = 1; i < lights.size(); ++i)
        index = hn::Sub(index, hn::VecFromMask(di, hn::RebindMask(di, hn::Ge(c, hn::Set(d, begins[i])))));
    }
    const Lookup at(lights, index);
    const V3 p = MulAdd(at.Vector(Column::edge_u), hn::LoadU(d, u + k),
                        MulAdd(at.Vector(Column::edge_v), hn::LoadU(d, v + k), at.Vector(Column::corner)));
    const V3 to = p - Load(from, k);
    const V distance2 = Dot(to, to), distance = hn::Sqrt(distance2);
    const V3 wo = to * hn::Div(One(), distance);
    const V cosine = hn::Neg(Dot(wo, at.Vector(Column::normal)));
    const V pdf = hn::Mul(hn::Div(hn::Mul(at(Column::inverse_area), distance2), cosine), at(Column::probability));
    const auto seen = hn::And(hn::Gt(cosine, zero), hn::Gt(distance2, zero));
    Store(wo, samples.wo, k);
    hn::StoreU(distance, d, samples.distance + k);
    hn::StoreU(pdf, d, samples.pdf + k);
    Store(IfThenElseZero(seen, at.Vector(Column::radiance) * hn::Div(One(), pdf)), samples.weight, k);
  }
}

HWY_INLINE hn::Mask<D> IsZero(const V3& v) {
  const V zero = hn::Zero(d);
  return hn::And(hn::And(hn::Eq(v.x, zero), hn::Eq(v.y, zero)), hn::Eq(v.z, zero));
}

std::size_t MakeShadowRays(std::size_t n, const Vec3Array& position, const Vec3Array& ng, const float* time,
                           const LightSamples& samples, const Vec3Array& value, const float* bsdf_pdf,
                           const float* inv_q, const RayStream& rays, const Vec3Array& light, std::uint32_t* vertex) {
  const V endless = hn::Set(d, std::numeric_limits<float>::max());
  std::size_t count = 0;
  for (std::size_t k = 0; k < n; k += hn::Lanes(d)) {
    const V pdf = hn::LoadU(d, samples.pdf + k), other = hn::LoadU(d, bsdf_pdf + k);
    // [Veach 1997, 9.2.4]
    const V a = hn::Mul(pdf, pdf), b = hn::Mul(other, other), mis = hn::Div(a, hn::Add(a, b));
    V scale = hn::IfThenElse(hn::IsInf(pdf), One(), hn::IfThenElseZero(hn::IsFinite(mis), mis));
    if (inv_q) scale = hn::Mul(scale, hn::LoadU(d, inv_q + k));
    const V3 weight = Load(samples.weight, k), f = Load(value, k);
    const V3 local{hn::Mul(hn::Mul(f.x, weight.x), scale), hn::Mul(hn::Mul(f.y, weight.y), scale),
                   hn::Mul(hn::Mul(f.z, weight.z), scale)};
    // Where there is no sample its direction is anything, and so is the value of the BSDF.
    const auto lit = hn::AndNot(hn::Or(IsZero(weight), IsZero(local)), hn::FirstN(d, n - k));
    if (hn::AllFalse(d, lit)) continue;

    const V3 p = Load(position, k), normal = Load(ng, k), wo = Load(samples.wo, k);
    const V distance = hn::LoadU(d, samples.distance + k);
    const V largest = hn::Max(hn::Abs(p.x), hn::Max(hn::Abs(p.y), hn::Abs(p.z)));
    const V push = hn::CopySign(hn::MulAdd(largest, hn::Set(d, kRayEpsilon), hn::Set(d, kRayEpsilon)), Dot(normal, wo));
    const V3 origin = MulAdd(normal, push, p);
    const V3 to = MulAdd(wo, distance, p) - origin;
    const V length = hn::Sqrt(Dot(to, to));
    const auto infinite = hn::IsInf(distance);
    const V3 direction = IfThenElse(infinite, wo, to * hn::Div(One(), length));
    const V end = hn::IfThenElse(infinite, endless, hn::Mul(length, hn::Set(d, 1 - kShadowEpsilon)));

    const auto store = [&](V v, float* to_array) { hn::StoreU(hn::Compress(v, lit), d, to_array + count); };
    store(origin.x, rays.ox), store(origin.y, rays.oy), store(origin.z, rays.oz);
    store(direction.x, rays.dx), store(direction.y, rays.dy), store(direction.z, rays.dz);
    store(end, rays.t_max);
    store(hn::LoadU(d, time + k), rays.time);
    store(local.x, light.x), store(local.y, light.y), store(local.z, light.z);
    const auto numbers = hn::Iota(di, static_cast<int>(k));
    hn::StoreU(hn::Compress(numbers, hn::RebindMask(di, lit)), di, reinterpret_cast<std::int32_t*>(vertex) + count);
    count += hn::CountTrue(d, lit);
  }
  return count;
}

}  // namespace warpath::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace warpath {

HWY_EXPORT(SampleRectangles);
HWY_EXPORT(MakeShadowRays);

RectangleLights::RectangleLights(std::span<const Light> lights) : m_size(lights.size()) {
  WARPATH_CHECK(m_size > 0 && m_size <= kMost);
  for (std::size_t i = 0; i < m_size; ++i) {
    const Light& light = lights[i];
    const auto put = [&](int column, const auto& v) {
      for (int c = 0; c < 3; ++c) m_columns[column + c][i] = v[c];
    };
    put(corner, light.corner);
    put(edge_u, light.edge_u);
    put(edge_v, light.edge_v);
    put(normal, light.normal);
    put(radiance, light.radiance);
    m_columns[inverse_area][i] = light.inverse_area;
    m_columns[choice_begin][i] = light.choice_begin;
    m_columns[probability][i] = light.probability;
  }
}

void RectangleLights::sample(std::size_t n, const Vec3Array& from, const float* choice, const float* u, const float* v,
                             const LightSamples& samples) const {
  HWY_DYNAMIC_DISPATCH(SampleRectangles)(*this, n, from, choice, u, v, samples);
}

std::size_t make_shadow_rays(std::size_t n, const Vec3Array& position, const Vec3Array& ng, const float* time,
                             const LightSamples& samples, const Vec3Array& value, const float* bsdf_pdf,
                             const float* inv_q, const RayStream& rays, const Vec3Array& light, std::uint32_t* vertex) {
  return HWY_DYNAMIC_DISPATCH(MakeShadowRays)(n, position, ng, time, samples, value, bsdf_pdf, inv_q, rays, light,
                                              vertex);
}

}  // namespace warpath
#endif
