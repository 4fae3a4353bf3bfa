#include <algorithm>

#include "tracer/lobe_model.h"
#include "tracer/material.h"
#include "tracer/scatter.h"

namespace warpath {

namespace {

/// The frame as the lobe sees it.
Frame frame_of(const Scatter& scatter, const ScatterLobe& lobe) {
  Frame f = scatter_frame(scatter, lobe.frame);
  if (lobe.mirrored) f.n = -f.n;
  return f;
}

/// What bump and normal maps take away from a lobe's light along wo: all where the normals before and after disagree
/// on wo's side, and a smooth shadow near the terminator.
float map_factor(const Scatter& scatter, const ScatterLobe& lobe, const Vec3& wo) {
  float factor = 1;
  for (int frame = lobe.frame; frame != 0;) {
    const PerturbedFrame& p = scatter.perturbed[frame - 1];
    const Vec3 inner_n = scatter_normal(scatter, frame);
    Vec3 outer_n = scatter_normal(scatter, p.outer);
    if (p.mirrored) outer_n = -outer_n;
    const float cos_outer = wo.dot(outer_n);
    if (!(wo.dot(inner_n) * cos_outer > 0)) return 0;
    if (p.shadowed) {
      const float cos2_n = larger(sqr(inner_n.dot(outer_n)), 1e-12f), cos2_o = larger(sqr(cos_outer), 1e-12f);
      const float alpha2 = smaller(0.125f * larger(0.0f, 1 - cos2_n) / cos2_n, 1.0f);
      factor *= 2 / (1 + std::sqrt(1 + alpha2 * larger(0.0f, 1 - cos2_o) / cos2_o));
    }
    frame = p.outer;
  }
  return factor;
}

LobeEval eval(const Scatter& scatter, const ScatterLobe& lobe, const Vec3& wo) {
  const Frame frame = frame_of(scatter, lobe);
  LobeEval e = eval_lobe(scatter.models[lobe.model], &scatter.values[lobe.first_value], frame.to_local(scatter.wi),
                         frame.to_local(wo));
  if (lobe.frame != 0) {
    const float factor = map_factor(scatter, lobe, wo);
    e.value *= factor;
    if (factor == 0) e.pdf = 0;
  }
  return e;
}

const ScatterLobe* lobes_end(const Scatter& scatter) { return scatter.lobes.data() + scatter.lobe_count; }

}  // namespace

Color eval_pdf_bsdf(const Scatter& scatter, const Vec3& wo, float& pdf) {
  const ScatterLobe& first = scatter.lobes[0];
  const auto* diffuse = std::get_if<Lobe<Diffuse>>(&scatter.models[first.model].lobe);
  if (diffuse && scatter.lobe_count == 1 && first.frame == 0) {
    // Common, and needs no more of its frame than the normal.
    const float side = first.mirrored ? -1.0f : 1.0f;
    const LobeEval e =
        diffuse->eval({{scatter.values[0], scatter.values[1], scatter.values[2]}},
                      {0, 0, side * scatter.wi.dot(scatter.frame.n)}, {0, 0, side * wo.dot(scatter.frame.n)});
    pdf = e.pdf;
    return e.value;
  }
  LobeEval sum;
  for (const ScatterLobe* l = scatter.lobes.data(); l != lobes_end(scatter); ++l) {
    const LobeEval e = eval(scatter, *l, wo);
    sum.value += e.value * l->weight;
    sum.pdf += e.pdf * l->weight;
  }
  pdf = sum.pdf;
  return sum.value;
}

BsdfSample sample_bsdf(const Scatter& scatter, float u, const Vec2& dir) {
  const ScatterLobe* lobe = scatter.lobes.data();
  if (scatter.lobe_count > 1) {
    while (u >= lobe->weight && lobe + 1 != lobes_end(scatter)) u -= (lobe++)->weight;
    u = smaller(u / lobe->weight, kOneMinusEpsilon);
  }
  const Frame frame = frame_of(scatter, *lobe);
  const LobeSample s =
      sample_lobe(scatter.models[lobe->model], &scatter.values[lobe->first_value], frame.to_local(scatter.wi), u, dir);
  BsdfSample result;
  result.wo = frame.to_world(s.wo);
  result.weight = s.weight;
  result.pdf = s.pdf * lobe->weight;
  result.eta = s.eta;
  result.delta = s.delta;
  result.null = s.null;
  if (s.null) result.wo = -scatter.wi;
  const float factor = lobe->frame == 0 ? 1 : map_factor(scatter, *lobe, result.wo);
  if (s.pdf == 0 || factor == 0) {
    // Nothing was sampled; other lobes have no say, since this direction is not drawn with the density of any.
    result.weight = Color(0.0f);
    result.pdf = 0;
    return result;
  }
  result.weight *= factor;
  // A delta lobe has its direction for itself. (Mitsuba 3.9 adds the densities of other lobes to its probability.)
  if (s.delta || scatter.lobe_count == 1) return result;

  Color value = result.weight * result.pdf;
  for (const ScatterLobe* l = scatter.lobes.data(); l != lobes_end(scatter); ++l) {
    if (l == lobe) continue;
    const LobeEval e = eval(scatter, *l, result.wo);
    value += e.value * l->weight;
    result.pdf += e.pdf * l->weight;
  }
  result.weight = result.pdf > 0 ? value * (1 / result.pdf) : Color(0.0f);
  return result;
}

bool is_smooth(const Scatter& scatter) { return scatter.smooth; }

Color albedo(const Scatter& scatter) {
  Color sum(0.0f);
  for (const ScatterLobe* l = scatter.lobes.data(); l != lobes_end(scatter); ++l)
    sum += lobe_albedo(scatter.models[l->model], &scatter.values[l->first_value],
                       frame_of(scatter, *l).to_local(scatter.wi)) *
           l->weight;
  return sum;
}

float roughness(const Scatter& scatter) {
  float sum = 0;
  for (const ScatterLobe* l = scatter.lobes.data(); l != lobes_end(scatter); ++l)
    sum += lobe_roughness(scatter.models[l->model], &scatter.values[l->first_value]) * l->weight;
  return sum;
}

SurfaceKind kind(const Scatter& scatter) {
  const auto of = [&](const ScatterLobe& l) {
    return lobe_kind(scatter.models[l.model], &scatter.values[l.first_value]);
  };
  const SurfaceKind first = of(scatter.lobes[0]);
  const bool same =
      std::all_of(scatter.lobes.data(), lobes_end(scatter), [&](const ScatterLobe& l) { return of(l) == first; });
  return same ? first : SurfaceKind::mixed;
}

Vec3 shading_normal(const Scatter& scatter) {
  // Of the lobe with the largest share.
  const ScatterLobe* lobe = std::max_element(scatter.lobes.data(), lobes_end(scatter),
                                             [](const auto& a, const auto& b) { return a.weight < b.weight; });
  const Vec3 n = scatter_normal(scatter, lobe->frame);
  return n.dot(scatter.wi) < 0 ? -n : n;
}

}  // namespace warpath
