#include "tracer/plain_bsdf.h"

#include "tracer/frame.h"
#include "tracer/fresnel.h"
#include "tracer/microfacet.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tracer/plain_bsdf.cpp"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// After highway.h, which they need.
#include <hwy/contrib/math/math-inl.h>

#include "tracer/simd_math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace warpath::HWY_NAMESPACE {

struct Eval {
  V3 value;
  V pdf;
};

/// A rough plastic's parameters, the same for all vertices.
struct Plastic {
  explicit Plastic(const PlainBsdf& bsdf)
      : plain(bsdf), m(bsdf.plastic), transmittance(m ? m->transmittance.nodes() : nullptr) {}

  HWY_INLINE V Transmittance(V cos_theta) const {
    constexpr int kNodes = RoughTransmittance::kNodes;
    const V x = hn::Mul(cos_theta, hn::Set(d, kNodes - 1.0f));
    const auto i = hn::Max(hn::Zero(di), hn::Min(hn::ConvertTo(di, x), hn::Set(di, kNodes - 2)));
    const V t = hn::Sub(x, hn::ConvertTo(d, i));
    return hn::MulAdd(hn::GatherIndex(d, transmittance + 1, i), t,
                      hn::Mul(hn::GatherIndex(d, transmittance, i), hn::Sub(One(), t)));
  }

  /// Probability of the specular lobe when `transmitted` of the light enters the base.
  HWY_INLINE V SpecularProbability(V transmitted) const {
    const V specular = hn::Mul(hn::Sub(One(), transmitted), hn::Set(d, m->specular_sampling_weight));
    const V sum = hn::MulAdd(transmitted, hn::Set(d, 1 - m->specular_sampling_weight), specular);
    return hn::IfThenElse(hn::Gt(sum, hn::Zero(d)), hn::Div(specular, sum), One());
  }

  HWY_INLINE V BaseReflectance(V diffuse) const {
    const float inv_eta2 = 1 / (m->bsdf.eta * m->bsdf.eta), r = m->internal_reflectance;
    if (!m->bsdf.nonlinear) return hn::Mul(diffuse, hn::Set(d, inv_eta2 / (1 - r)));
    return hn::Div(hn::Mul(diffuse, hn::Set(d, inv_eta2)), hn::NegMulAdd(diffuse, hn::Set(d, r), One()));
  }

  HWY_INLINE V Fresnel(V cos_i) const {
    const V eta = hn::Set(d, m->bsdf.eta), inv2 = hn::Set(d, sqr(1 / m->bsdf.eta));
    const V sin2 = hn::NegMulAdd(cos_i, cos_i, One());
    const V cos_t = hn::Sqrt(hn::Max(hn::Zero(d), hn::NegMulAdd(sin2, inv2, One())));
    const V s = hn::Mul(eta, cos_t), p = hn::Mul(eta, cos_i);
    const V a_s = hn::Div(hn::Sub(cos_i, s), hn::Add(cos_i, s)), a_p = hn::Div(hn::Sub(cos_t, p), hn::Add(cos_t, p));
    return hn::Mul(hn::Set(d, 0.5f), hn::MulAdd(a_s, a_s, hn::Mul(a_p, a_p)));
  }

  /// D of a microfacet normal whose angle with the normal has this cosine and this sine squared.
  HWY_INLINE V Distribution(V cosine, V sin2) const {
    const float alpha2 = m->bsdf.alpha * m->bsdf.alpha;
    const V cos2 = hn::Mul(cosine, cosine);
    V density;
    if (m->bsdf.distribution == MicrofacetType::ggx) {
      const V sum = hn::MulAdd(cos2, hn::Set(d, alpha2), sin2);  // over alpha^2
      density = hn::Div(hn::Set(d, alpha2 / kPi), hn::Mul(sum, sum));
    } else {
      const V area = hn::Mul(hn::Set(d, kPi * alpha2), hn::Mul(cos2, cos2));
      density = hn::Div(hn::Exp(d, hn::Div(sin2, hn::Mul(cos2, hn::Set(d, -alpha2)))), area);
    }
    return hn::IfThenElseZero(hn::Gt(hn::Mul(density, cosine), hn::Set(d, 1e-20f)), density);
  }

  HWY_INLINE V SmithG1(V cosine) const {
    const V cos2 = hn::Mul(cosine, cosine);
    const V sin2 = hn::Max(hn::Zero(d), hn::Sub(One(), cos2));
    const V tan2 = hn::Div(hn::Mul(sin2, hn::Set(d, m->bsdf.alpha * m->bsdf.alpha)), cos2);
    if (m->bsdf.distribution == MicrofacetType::ggx)
      return hn::Div(hn::Set(d, 2.0f), hn::Add(One(), hn::Sqrt(hn::Add(One(), tan2))));
    const V a = hn::Div(One(), hn::Sqrt(tan2));
    const V over = hn::Mul(a, hn::MulAdd(a, hn::Set(d, 2.181f), hn::Set(d, 3.535f)));
    const V under = hn::MulAdd(a, hn::MulAdd(a, hn::Set(d, 2.577f), hn::Set(d, 2.276f)), One());
    return hn::IfThenElse(hn::Lt(a, hn::Set(d, 1.6f)), hn::Div(over, under), One());
  }

  HWY_INLINE Eval operator()(const V3& n, const V3& wi, V cos_i, const V3& reflectance, const V3& wo) const {
    const V zero = hn::Zero(d), cos_o = Dot(wo, n);
    const auto valid = hn::And(hn::Gt(cos_i, zero), hn::Gt(cos_o, zero));
    const V t_i = Transmittance(cos_i), t_o = Transmittance(cos_o), specular = SpecularProbability(t_i);
    const V cosine = hn::Mul(cos_o, hn::Set(d, 1 / kPi)), base = hn::Mul(cosine, hn::Mul(t_i, t_o));

    const V3 h = Unit(wi + wo);
    const V cos_h = Dot(wi, h);
    const V3 across = Cross(h, n);
    const V density = Distribution(Dot(h, n), Dot(across, across));
    const auto seen = hn::Gt(cos_h, zero);
    const V common =
        hn::IfThenElseZero(seen, hn::Div(hn::Mul(density, SmithG1(cos_i)), hn::Mul(hn::Set(d, 4.0f), cos_i)));
    const V surface = hn::IfThenElseZero(seen, hn::Mul(hn::Mul(Fresnel(cos_h), common), SmithG1(cos_o)));
    const auto channel = [&](V diffuse, float spec) {
      return hn::IfThenElseZero(valid, hn::MulAdd(BaseReflectance(diffuse), base, hn::Mul(hn::Set(d, spec), surface)));
    };
    return {{channel(reflectance.x, plain.specular.x), channel(reflectance.y, plain.specular.y),
             channel(reflectance.z, plain.specular.z)},
            hn::IfThenElseZero(valid, hn::MulAdd(specular, common, hn::Mul(hn::Sub(One(), specular), cosine)))};
  }

  const PlainBsdf& plain;
  const Lobe<RoughPlastic>* m;
  const float* transmittance;
};

/// The normal on the side that the BSDF looks from, and the cosine of wi to it.
HWY_INLINE V3 Facing(const PlainBsdf& bsdf, const PlainVertices& v, std::size_t k, const V3& wi, V& cos_i) {
  const V3 n = Load(v.normal, k);
  cos_i = Dot(wi, n);
  if (!bsdf.two_sided) return n;
  const V side = hn::CopySignToAbs(One(), cos_i);
  cos_i = hn::Abs(cos_i);
  return n * side;
}

void EvalPlain(const PlainBsdf& bsdf, const PlainVertices& v, std::size_t begin, std::size_t end, const Vec3Array& wo,
               const Vec3Array& value, float* pdf) {
  if (!bsdf.plastic) {
    for (std::size_t k = begin; k < end; k += hn::Lanes(d)) {
      V cos_i;
      const V3 n = Facing(bsdf, v, k, Load(v.wi, k), cos_i);
      const V cos_o = Dot(Load(wo, k), n), zero = hn::Zero(d);
      const V p =
          hn::IfThenElseZero(hn::And(hn::Gt(cos_i, zero), hn::Gt(cos_o, zero)), hn::Mul(cos_o, hn::Set(d, 1 / kPi)));
      Store(Load(v.reflectance, k) * p, value, k);
      hn::StoreU(p, d, pdf + k);
    }
    return;
  }
  const Plastic plastic(bsdf);
  for (std::size_t k = begin; k < end; k += hn::Lanes(d)) {
    V cos_i;
    const V3 wi = Load(v.wi, k), n = Facing(bsdf, v, k, wi, cos_i);
    const Eval e = plastic(n, wi, cos_i, Load(v.reflectance, k), Load(wo, k));
    Store(e.value, value, k);
    hn::StoreU(e.pdf, d, pdf + k);
  }
}

/// Of the light that rough plastic reflects at its surface: few directions, so one after the other.
HWY_INLINE void SampleSurface(const RoughPlastic& bsdf, const V3& n, const V3& wi, V dir_u, V dir_v, hn::Mask<D> chosen,
                              V3& wo) {
  HWY_ALIGN float lanes[11][hn::MaxLanes(D())];
  const V vectors[11]{n.x, n.y, n.z, wi.x, wi.y, wi.z, dir_u, dir_v, wo.x, wo.y, wo.z};
  for (int i = 0; i < 11; ++i) hn::Store(vectors[i], d, lanes[i]);
  HWY_ALIGN std::uint8_t bits[8]{};
  hn::StoreMaskBits(d, chosen, bits);
  const Microfacet distribution(bsdf.distribution, bsdf.alpha, bsdf.alpha, true);
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
    if (!(bits[i / 8] >> i % 8 & 1)) continue;
    const Frame frame = frame_of_normal({lanes[0][i], lanes[1][i], lanes[2][i]});
    const Vec3 local = frame.to_local({lanes[3][i], lanes[4][i], lanes[5][i]});
    const Vec3 out = frame.to_world(reflect_about(local, distribution.sample(local, {lanes[6][i], lanes[7][i]})));
    lanes[8][i] = out.x, lanes[9][i] = out.y, lanes[10][i] = out.z;
  }
  wo = {hn::Load(d, lanes[8]), hn::Load(d, lanes[9]), hn::Load(d, lanes[10])};
}

void SamplePlain(const PlainBsdf& bsdf, const PlainVertices& v, std::size_t begin, std::size_t end, const float* lobe,
                 const float* dir_u, const float* dir_v, const Vec3Array& wo, const Vec3Array& weight, float* pdf) {
  const bool diffuse = !bsdf.plastic;
  const Plastic plastic(bsdf);
  for (std::size_t k = begin; k < end; k += hn::Lanes(d)) {
    V cos_i;
    const V3 wi = Load(v.wi, k), n = Facing(bsdf, v, k, wi, cos_i), reflectance = Load(v.reflectance, k);
    const V u0 = hn::LoadU(d, dir_u + k), u1 = hn::LoadU(d, dir_v + k), zero = hn::Zero(d);
    const auto front = hn::Gt(cos_i, zero);
    V cos_o;
    V3 out = CosineHemisphere(n, u0, u1, cos_o), w = reflectance;
    V p;
    if (diffuse) {
      p = hn::IfThenElseZero(front, hn::Mul(cos_o, hn::Set(d, 1 / kPi)));
    } else {
      auto surface = hn::Lt(hn::LoadU(d, lobe + k), plastic.SpecularProbability(plastic.Transmittance(cos_i)));
      surface = hn::And(hn::And(surface, front), hn::FirstN(d, end - k));
      if (!hn::AllFalse(d, surface)) SampleSurface(bsdf.plastic->bsdf, n, wi, u0, u1, surface, out);
      const Eval e = plastic(n, wi, cos_i, reflectance, out);
      p = e.pdf;
      w = e.value * hn::Div(One(), p);
    }
    const auto made = hn::Gt(p, zero);
    Store(out, wo, k);
    Store(IfThenElseZero(made, w), weight, k);
    hn::StoreU(hn::IfThenElseZero(made, p), d, pdf + k);
  }
}

}  // namespace warpath::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace warpath {

HWY_EXPORT(EvalPlain);
HWY_EXPORT(SamplePlain);

Color plain_albedo(const PlainBsdf& bsdf, float cos_theta_i, const Color& reflectance) {
  return bsdf.plastic ? bsdf.plastic->albedo({reflectance, bsdf.specular}, {0, 0, cos_theta_i}) : reflectance;
}
float plain_roughness(const PlainBsdf& bsdf) { return bsdf.plastic ? bsdf.plastic->roughness({}) : 1; }
SurfaceKind plain_kind(const PlainBsdf& bsdf) { return bsdf.plastic ? SurfaceKind::mixed : SurfaceKind::diffuse; }

void eval_plain(const PlainBsdf& bsdf, const PlainVertices& vertices, std::size_t begin, std::size_t end,
                const Vec3Array& wo, const Vec3Array& value, float* pdf) {
  HWY_DYNAMIC_DISPATCH(EvalPlain)(bsdf, vertices, begin, end, wo, value, pdf);
}
void sample_plain(const PlainBsdf& bsdf, const PlainVertices& vertices, std::size_t begin, std::size_t end,
                  const float* lobe, const float* dir_u, const float* dir_v, const Vec3Array& wo,
                  const Vec3Array& weight, float* pdf) {
  HWY_DYNAMIC_DISPATCH(SamplePlain)(bsdf, vertices, begin, end, lobe, dir_u, dir_v, wo, weight, pdf);
}

}  // namespace warpath
#endif
