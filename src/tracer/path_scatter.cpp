// What happens at vertices: light sampling, BSDF sampling and Russian roulette.
#include <algorithm>
#include <limits>

#include "tracer/path_loop.h"

namespace warpath {
namespace {

bool is_zero(const Color& c) { return c.x == 0 && c.y == 0 && c.z == 0; }

constexpr float kEndless = std::numeric_limits<float>::max();
constexpr float kMaxSurvival = 0.95f;

// How many vertices before its turn a Scatter is asked for.
constexpr std::size_t kScatterAhead = 4;

void prefetch(const Scatter& scatter) {
  const char* line = reinterpret_cast<const char*>(&scatter);
  for (std::size_t i = 0; i < sizeof(Scatter); i += 64) __builtin_prefetch(line + i);
}

// Places of a bounce's numbers in VertexRecords::numbers.
constexpr int kLight = 0, kLightUv = 1, kLobe = 3, kDir = 4, kRoulette = 6;

}  // namespace

void PathLoop::sample_emitters(std::uint16_t bounce, Color* radiance, PathRecorder* recorder) {
  Workspace& w = m_work;
  if (m_scene.emitters.size() == 0) return;
  std::size_t n = 0;
  for (std::size_t j = 0; j < m_vertices; ++j) {
    w.slot[j] = static_cast<std::uint32_t>(n);
    if (!w.smooth[j]) continue;
    w.subset[n] = static_cast<std::uint32_t>(j);
    w.subset_lanes[n++] = w.vertex_lanes[j];
  }
  if (n == 0) return;
  if (m_needs_context)
    for (std::size_t i = 0; i < n; ++i) w.subset_context.copy(i, w.context, w.subset[i]);
  const VertexContext context = w.subset_context.view();
  const VertexContext* shown = m_needs_context ? &context : nullptr;
  const std::span<const std::uint32_t> lanes(w.subset_lanes, n);

  const bool choose = m_scene.emitters.needs_choice();
  const bool weigh_choice = choose && draw({GroupKind::light, bounce}, lanes, shown, w.light);
  const bool weigh_uv = draw({GroupKind::light_uv, bounce}, lanes, shown, w.light_uv);
  const bool weigh = weigh_choice || weigh_uv;
  const auto inv_q = [&](std::size_t i) {
    return (weigh_choice ? w.light.inv_q[i] : 1.0f) * (weigh_uv ? w.light_uv.inv_q[i] : 1.0f);
  };
  if (recorder) {
    for (std::size_t i = 0; i < n; ++i) {
      recorder->number(w.subset[i], kLight, choose ? w.light.u0[i] : 0.0f);
      recorder->number(w.subset[i], kLightUv, w.light_uv.u0[i]);
      recorder->number(w.subset[i], kLightUv + 1, w.light_uv.u1[i]);
      recorder->inv_q_light(w.subset[i], inv_q(i));
    }
  }
  // From here on in the order of shading. Those that are not smooth get numbers of others, which come to nothing.
  const DrawnNumbers& ordered = w.ordered;
  for (std::size_t k = 0; k < m_vertices; ++k) {
    const std::uint32_t i = std::min(w.slot[w.order[k]], static_cast<std::uint32_t>(n - 1));
    if (choose) w.ordered_choice[k] = w.light.u0[i];
    ordered.u0[k] = w.light_uv.u0[i];
    ordered.u1[k] = w.light_uv.u1[i];
    if (weigh) ordered.inv_q[k] = inv_q(i);
  }
  m_scene.emitters.sample(m_vertices, w.position, choose ? w.ordered_choice : nullptr, ordered.u0, ordered.u1, w.time,
                          w.samples);
  for (const Workspace::Group& group : w.groups) {
    if (group.plain) {
      eval_plain(*group.plain, w.plain, group.begin, group.end, w.samples.wo, w.value, w.pdf);
      continue;
    }
    for (std::size_t k = group.begin; k < group.end; ++k) {
      if (k + kScatterAhead < group.end) prefetch(w.scatter[k + kScatterAhead]);
      const Scatter& scatter = w.scatter[k];
      Color value(0.0f);
      w.pdf[k] = 0;
      if (scatter.smooth && !is_zero(w.samples.weight.color(k)))
        value = eval_pdf_bsdf(scatter, w.samples.wo[k], w.pdf[k]);
      w.value.set(k, {value.x, value.y, value.z});
    }
  }
  const std::size_t shadows =
      make_shadow_rays(m_vertices, w.position, w.ng, w.time, w.samples, w.value, w.pdf, weigh ? ordered.inv_q : nullptr,
                       w.shadow_rays, w.shadow_light, w.shadow_vertex);
  trace_shadow_rays(shadows, radiance, recorder);
}

void PathLoop::trace_shadow_rays(std::size_t count, Color* radiance, PathRecorder* recorder) {
  Workspace& w = m_work;
  m_scene.embree.occluded(w.shadow_rays, count, w.shadowed);
  for (std::size_t i = 0; i < count; ++i) {
    if (w.shadowed[i]) continue;
    const std::uint32_t j = w.order[w.shadow_vertex[i]], lane = w.vertex_lanes[j];
    const Color local = w.shadow_light.color(i);
    radiance[lane] += w.beta.color(lane) * local * w.weight[lane];
    if (recorder) recorder->light(j, local);
  }
}

void PathLoop::sample_bsdfs(std::uint16_t bounce, PathRecorder* recorder) {
  Workspace& w = m_work;
  const std::span<const std::uint32_t> lanes(w.vertex_lanes, m_vertices);
  const VertexContext context = w.context.view();
  const VertexContext* shown = m_needs_context ? &context : nullptr;
  const bool weigh_lobe = draw({GroupKind::lobe, bounce}, lanes, shown, w.lobe);
  const bool weigh_dir = draw({GroupKind::dir, bounce}, lanes, shown, w.dir);
  const DrawnNumbers& ordered = w.ordered;
  for (std::size_t k = 0; k < m_vertices; ++k) {
    const std::uint32_t j = w.order[k];
    w.ordered_choice[k] = w.lobe.u0[j];
    ordered.u0[k] = w.dir.u0[j];
    ordered.u1[k] = w.dir.u1[j];
  }
  for (const Workspace::Group& group : w.groups) {
    if (group.plain) {
      sample_plain(*group.plain, w.plain, group.begin, group.end, w.ordered_choice, ordered.u0, ordered.u1,
                   w.samples.wo, w.value, w.pdf);
      std::fill(w.step_eta + group.begin, w.step_eta + group.end, 1.0f);
      std::fill(w.straight_on + group.begin, w.straight_on + group.end, std::uint8_t{0});
      continue;
    }
    for (std::size_t k = group.begin; k < group.end; ++k) {
      if (k + kScatterAhead < group.end) prefetch(w.scatter[k + kScatterAhead]);
      const BsdfSample s = sample_bsdf(w.scatter[k], w.ordered_choice[k], {ordered.u0[k], ordered.u1[k]});
      w.samples.wo.set(k, s.wo);
      w.value.set(k, {s.weight.x, s.weight.y, s.weight.z});
      w.pdf[k] = s.delta ? 0.0f : s.pdf;
      w.step_eta[k] = s.eta;
      w.straight_on[k] = s.null;
    }
  }
  // Back in the order of paths.
  m_rays = 0;
  for (std::size_t j = 0; j < m_vertices; ++j) {
    const std::uint32_t k = w.rank[j], lane = w.vertex_lanes[j];
    const float inv_q = (weigh_lobe ? w.lobe.inv_q[j] : 1.0f) * (weigh_dir ? w.dir.inv_q[j] : 1.0f);
    const Color weight = w.value.color(k);
    if (recorder) {
      recorder->number(j, kLobe, w.lobe.u0[j]);
      recorder->number(j, kDir, w.dir.u0[j]);
      recorder->number(j, kDir + 1, w.dir.u1[j]);
      recorder->inv_q_scatter(j, inv_q);
      recorder->step(j, weight * inv_q);
    }
    const Color beta = w.beta.color(lane) * weight;
    if (is_zero(beta)) continue;
    w.beta.set(lane, {beta.x, beta.y, beta.z});
    w.weight[lane] *= inv_q;
    w.eta[lane] *= w.step_eta[k];
    const Vec3 position = w.position[k], wo = w.samples.wo[k];
    w.previous.set(lane, position);
    w.previous_pdf[lane] = w.pdf[k];
    w.straight[lane] &= w.straight_on[k];
    // In the place of a ray that has been used up; `subset` remembers its vertex.
    w.rays.set(m_rays, offset_point(position, w.ng[k], wo), wo, kEndless, w.time[k]);
    w.lanes[m_rays] = lane;
    w.subset[m_rays++] = static_cast<std::uint32_t>(j);
  }
}

// Ends paths with the renderer's own throughput, so that what a path contributes depends on its numbers alone.
void PathLoop::play_roulette(std::uint16_t bounce, PathRecorder* recorder) {
  Workspace& w = m_work;
  if (static_cast<int>(bounce) < m_rr_depth || m_rays == 0) return;
  if (m_needs_context)
    for (std::size_t k = 0; k < m_rays; ++k) w.subset_context.copy(k, w.context, w.subset[k]);
  for (std::size_t k = 0; k < m_rays; ++k) {
    const std::uint32_t lane = w.lanes[k];
    w.survival[k] = smaller(max_component(w.beta.color(lane)) * sqr(w.eta[lane]), kMaxSurvival);
  }
  VertexContext context = w.subset_context.view();
  context.survival = w.survival;
  const bool weigh = draw({GroupKind::rr, bounce}, {w.lanes, m_rays}, m_needs_context ? &context : nullptr, w.roulette);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < m_rays; ++k) {
    const std::uint32_t lane = w.lanes[k];
    const Color beta = w.beta.color(lane);
    const float survival = w.survival[k];
    const bool survives = w.roulette.u0[k] < survival;
    const float inv_q = weigh ? w.roulette.inv_q[k] : 1.0f;
    if (recorder) {
      recorder->number(w.subset[k], kRoulette, w.roulette.u0[k]);
      recorder->scale_step(w.subset[k], survives ? inv_q / survival : 0.0f);
    }
    if (!survives) continue;
    const float scale = 1 / survival;
    w.beta.set(lane, Vec3(beta.x, beta.y, beta.z) * scale);
    w.weight[lane] *= inv_q;
    w.lanes[kept] = lane;
    w.rays.set(kept++, w.rays.origin(k), w.rays.direction(k), kEndless, w.rays.time[k]);
  }
  m_rays = kept;
}

}  // namespace warpath
