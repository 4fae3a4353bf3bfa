#include "tracer/path_loop.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

namespace warpath {
namespace {

// Power heuristic with exponent 2 for the first of two strategies. [Veach 1997, 9.2.4]
float mis_weight(float pdf, float other) {
  const float a = pdf * pdf, b = other * other;
  const float weight = a / (a + b);
  return std::isfinite(weight) ? weight : 0.0f;
}

bool is_zero(const Color& c) { return c.x == 0 && c.y == 0 && c.z == 0; }

constexpr float kEndless = std::numeric_limits<float>::max();
constexpr float kMaxSurvival = 0.95f;
constexpr std::uint32_t kLastBounce = 0xffff;  // what a Group can name

// How many hits before its turn the data of a hit is asked for.
constexpr std::size_t kTriangleAhead = 24, kVerticesAhead = 12, kTexturesAhead = 8;
// The same for vertices whose Scatter is used again.
constexpr std::size_t kScatterAhead = 4;

void prefetch(const Scatter& scatter) {
  const char* line = reinterpret_cast<const char*>(&scatter);
  for (std::size_t i = 0; i < sizeof(Scatter); i += 64) __builtin_prefetch(line + i);
}

// Places of a bounce's numbers in VertexRecords::numbers.
constexpr int kLight = 0, kLightUv = 1, kLobe = 3, kDir = 4, kRoulette = 6;

}  // namespace

PathLoop::PathLoop(const CompiledScene& scene, PrimarySource& source, Workspace& workspace, std::size_t lanes)
    : m_scene(scene),
      m_source(source),
      m_work(workspace),
      m_lanes(lanes),
      m_max_depth(scene.scene.integrator.max_depth),
      m_rr_depth(scene.scene.integrator.rr_depth),
      m_hide_emitters(scene.scene.integrator.hide_emitters) {
  workspace.resize(lanes);
}

bool PathLoop::draw(Group group, std::span<const std::uint32_t> lanes, const VertexContext* context,
                    const DrawnNumbers& numbers) {
  return m_source.draw(group, lanes, context, numbers.u0, group.size() == 2 ? numbers.u1 : nullptr, numbers.inv_q);
}

void PathLoop::start(float* film_x, float* film_y) {
  Workspace& w = m_work;
  const std::size_t n = m_lanes;
  std::iota(w.lanes, w.lanes + n, 0u);
  const std::span<const std::uint32_t> lanes(w.lanes, n);
  std::fill_n(w.weight, n, 1.0f);
  const auto apply = [&](GroupKind kind, const DrawnNumbers& numbers) {
    if (!draw({kind, 0}, lanes, nullptr, numbers)) return;
    for (std::size_t i = 0; i < n; ++i) w.weight[i] *= numbers.inv_q[i];
  };
  const Camera& camera = m_scene.camera;
  apply(GroupKind::film, w.film);
  if (camera.has_lens()) apply(GroupKind::lens, w.lens);
  const bool uses_time = m_scene.uses_time();
  if (uses_time) apply(GroupKind::time, w.shutter);

  const FilmSettings& film = m_scene.scene.film;
  for (std::size_t i = 0; i < n; ++i) {
    film_x[i] = static_cast<float>(film.crop_x) + w.film.u0[i] * static_cast<float>(film.crop_width);
    film_y[i] = static_cast<float>(film.crop_y) + w.film.u1[i] * static_cast<float>(film.crop_height);
    w.film.u0[i] = film_x[i] / static_cast<float>(film.width);
    w.film.u1[i] = film_y[i] / static_cast<float>(film.height);
  }
  if (!camera.has_lens() && !camera.moves()) {
    camera.pinhole_rays(n, w.film.u0, w.film.u1, w.rays);
    if (uses_time)
      std::copy_n(w.shutter.u0, n, w.rays.time);
    else
      std::fill_n(w.rays.time, n, 0.0f);
  } else {
    for (std::size_t i = 0; i < n; ++i) {
      const Vec2 lens = camera.has_lens() ? Vec2(w.lens.u0[i], w.lens.u1[i]) : Vec2(0);
      const float time = uses_time ? w.shutter.u0[i] : 0.0f;
      const Camera::Ray ray = camera.ray({w.film.u0[i], w.film.u1[i]}, lens, time);
      w.rays.set(i, ray.origin, ray.direction, ray.t_max, time);
    }
  }
  for (float* beta : {w.beta.x, w.beta.y, w.beta.z, w.eta}) std::fill_n(beta, n, 1.0f);
  std::fill_n(w.straight, n, std::uint8_t{1});
  m_rays = n;
  m_scene.embree.intersect(w.rays, n, w.hits, true);
  if (m_hide_emitters) skip_emitters();
}

// Camera rays pass through the shapes of emitters until they meet another surface.
void PathLoop::skip_emitters() {
  Workspace& w = m_work;
  RayStream& rays = w.shadow_rays;  // both are free here
  HitStream hits{w.light.u0,    w.light.u1,       w.light.inv_q,  w.light_uv.u0,
                 w.light_uv.u1, w.light_uv.inv_q, w.subset_lanes, w.shadow_vertex};
  const auto on_emitter = [&](std::uint32_t shape) { return shape != kNoHit && m_scene.surfaces.emitter(shape) >= 0; };
  SurfacePoint point;
  for (;;) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < m_rays; ++i) {
      if (!on_emitter(w.hits.shape[i])) continue;
      const Vec3 d = w.rays.direction(i);
      const Vec3 position = m_scene.surfaces.at(w.hits, i, w.rays, point);
      w.rays.set(i, offset_point(position, point.ng, d), d, kEndless, w.rays.time[i]);
      rays.set(count, w.rays.origin(i), d, kEndless, w.rays.time[i]);
      w.subset[count++] = static_cast<std::uint32_t>(i);
    }
    if (count == 0) return;
    m_scene.embree.intersect(rays, count, hits, false);
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t i = w.subset[k];
      w.hits.t[i] = hits.t[k];
      w.hits.u[i] = hits.u[k], w.hits.v[i] = hits.v[k];
      w.hits.nx[i] = hits.nx[k], w.hits.ny[i] = hits.ny[k], w.hits.nz[i] = hits.nz[k];
      w.hits.shape[i] = hits.shape[k];
      w.hits.primitive[i] = hits.primitive[k];
    }
  }
}

// Mitsuba's max_depth counts vertices beyond the camera: scattering at vertex k makes paths of k + 1.
bool PathLoop::may_continue(std::uint32_t bounce) const {
  return bounce < kLastBounce && (m_max_depth < 0 || bounce < static_cast<std::uint32_t>(m_max_depth));
}

void PathLoop::trace(Color* radiance, PathRecorder* recorder) {
  std::fill_n(radiance, m_lanes, Color(0.0f));
  m_needs_context = recorder || m_source.wants_context();
  for (std::uint32_t bounce = 1;; ++bounce) {
    resolve_hits(bounce, radiance, recorder);
    if (m_vertices == 0) return;
    const auto group_bounce = static_cast<std::uint16_t>(bounce);
    if (m_needs_context) fill_context();
    if (recorder) recorder->begin_bounce(group_bounce, {m_work.vertex_lanes, m_vertices}, m_work.context);
    sample_emitters(group_bounce, radiance, recorder);
    sample_bsdfs(group_bounce, recorder);
    play_roulette(group_bounce, recorder);
    if (m_rays == 0) return;
    m_scene.embree.intersect(m_work.rays, m_rays, m_work.hits, false);
  }
}

// Adds the emission that rays met, and makes vertices of the hits that scatter.
void PathLoop::resolve_hits(std::uint32_t bounce, Color* radiance, PathRecorder* recorder) {
  Workspace& w = m_work;
  const bool scatters = may_continue(bounce);
  const bool emits = bounce > 1;
  m_vertices = 0;
  // Vertices whose textures have been asked for, and wait for them a while.
  std::array<SurfacePoint, kTexturesAhead> waiting;
  std::size_t resolved = 0;
  const auto resolve_next = [&] {
    const SurfacePoint& point = waiting[resolved % kTexturesAhead];
    m_scene.materials.at(static_cast<BsdfId>(w.context.material[resolved]), point, w.scatter[resolved]);
    ++resolved;
  };
  const auto add = [&](std::uint32_t lane, const Color& emitted, float pdf) {
    if (m_hide_emitters && w.straight[lane]) return;
    const float previous_pdf = w.previous_pdf[lane];
    const Color local = emitted * (previous_pdf > 0 ? mis_weight(previous_pdf, pdf) : 1.0f);
    radiance[lane] += w.beta.color(lane) * local * w.weight[lane];
    if (recorder) recorder->emission(lane, local);
  };
  for (std::size_t i = 0; i < std::min(m_rays, kTriangleAhead); ++i) m_scene.surfaces.prefetch_triangle(w.hits, i);
  for (std::size_t i = 0; i < m_rays; ++i) {
    // Vertices of hits lie all over memory: without this, most of the time here would be spent on waiting for them.
    if (i + kTriangleAhead < m_rays) m_scene.surfaces.prefetch_triangle(w.hits, i + kTriangleAhead);
    if (i + kVerticesAhead < m_rays) m_scene.surfaces.prefetch_vertices(w.hits, i + kVerticesAhead);
    const std::uint32_t lane = w.lanes[i], shape = w.hits.shape[i];
    if (shape == kNoHit) {
      if (!emits || !m_scene.emitters.has_environment()) continue;
      const Vec3 d = w.rays.direction(i);
      add(lane, m_scene.emitters.environment_radiance(d),
          w.previous_pdf[lane] > 0 ? m_scene.emitters.environment_pdf(d) : 0.0f);
      continue;
    }
    const std::int32_t emitter = m_scene.surfaces.emitter(shape);
    if (!scatters && emitter < 0) continue;
    if (m_vertices - resolved == kTexturesAhead) resolve_next();
    SurfacePoint& point = waiting[m_vertices % kTexturesAhead];
    const Vec3 position = m_scene.surfaces.at(w.hits, i, w.rays, point);
    if (emits && emitter >= 0) {
      const Color emitted = m_scene.emitters.radiance(emitter, point);
      if (!is_zero(emitted))
        add(lane, emitted,
            w.previous_pdf[lane] > 0
                ? m_scene.emitters.pdf(emitter, w.previous[lane], position, point, w.hits.primitive[i], w.rays.time[i])
                : 0.0f);
    }
    if (!scatters) continue;
    const std::size_t j = m_vertices++;
    w.vertex_lanes[j] = lane;
    w.position.set(j, position);
    w.ng.set(j, point.ng);
    w.time[j] = w.rays.time[i];
    const BsdfId bsdf = m_scene.surfaces.bsdf(shape);
    w.context.material[j] = static_cast<std::uint32_t>(bsdf);
    m_scene.materials.prefetch(bsdf, point.uv);
    if (m_needs_context) w.context.wi.set(j, point.wi);
  }
  while (resolved < m_vertices) resolve_next();
}

void PathLoop::fill_context() {
  Workspace& w = m_work;
  for (std::size_t j = 0; j < m_vertices; ++j) {
    const Scatter& scatter = w.scatter[j];
    const Color a = albedo(scatter);
    w.context.position.set(j, w.position[j]);
    w.context.normal.set(j, shading_normal(scatter));
    w.context.albedo.set(j, {a.x, a.y, a.z});
    w.context.roughness[j] = roughness(scatter);
    w.context.kind[j] = static_cast<std::uint8_t>(kind(scatter));
  }
}

void PathLoop::sample_emitters(std::uint16_t bounce, Color* radiance, PathRecorder* recorder) {
  Workspace& w = m_work;
  if (m_scene.emitters.size() == 0) return;
  std::size_t n = 0;
  for (std::size_t j = 0; j < m_vertices; ++j) {
    if (!w.scatter[j].smooth) continue;
    w.subset[n] = static_cast<std::uint32_t>(j);
    w.subset_lanes[n++] = w.vertex_lanes[j];
  }
  if (n == 0) return;
  if (m_needs_context)
    for (std::size_t k = 0; k < n; ++k) w.subset_context.copy(k, w.context, w.subset[k]);
  const VertexContext context = w.subset_context.view();
  const VertexContext* shown = m_needs_context ? &context : nullptr;
  const std::span<const std::uint32_t> lanes(w.subset_lanes, n);

  const bool choose = m_scene.emitters.needs_choice();
  const bool weigh_choice = choose && draw({GroupKind::light, bounce}, lanes, shown, w.light);
  const bool weigh_uv = draw({GroupKind::light_uv, bounce}, lanes, shown, w.light_uv);
  std::size_t shadows = 0;
  EmitterSample sample;
  for (std::size_t k = 0; k < n; ++k) {
    if (k + kScatterAhead < n) prefetch(w.scatter[w.subset[k + kScatterAhead]]);
    const std::uint32_t j = w.subset[k];
    const float choice = choose ? w.light.u0[k] : 0.0f;
    const float inv_q = (weigh_choice ? w.light.inv_q[k] : 1.0f) * (weigh_uv ? w.light_uv.inv_q[k] : 1.0f);
    if (recorder) {
      recorder->number(j, kLight, choice);
      recorder->number(j, kLightUv, w.light_uv.u0[k]);
      recorder->number(j, kLightUv + 1, w.light_uv.u1[k]);
      recorder->inv_q_light(j, inv_q);
    }
    const Vec3 position = w.position[j];
    const float time = w.time[j];
    if (!m_scene.emitters.sample(position, choice, {w.light_uv.u0[k], w.light_uv.u1[k]}, time, sample)) continue;
    float bsdf_pdf;
    const Color value = eval_pdf_bsdf(w.scatter[j], sample.wo, bsdf_pdf);
    const float mis = sample.delta ? 1.0f : mis_weight(sample.pdf, bsdf_pdf);
    const Color local = value * sample.weight * (mis * inv_q);
    if (is_zero(local)) continue;
    const Vec3 ng = w.ng[j];
    Vec3 origin, d = sample.wo;
    float end = kEndless;
    if (std::isinf(sample.distance)) {
      origin = offset_point(position, ng, d);
    } else {
      const Vec3 target = position + d * sample.distance;
      origin = offset_point(position, ng, d);
      d = target - origin;
      const float length = std::sqrt(d.dot(d));
      d *= 1 / length;
      end = length * (1 - kShadowEpsilon);
    }
    w.shadow_rays.set(shadows, origin, d, end, time);
    w.shadow_vertex[shadows] = j;
    w.shadow_light.set(shadows++, {local.x, local.y, local.z});
  }
  trace_shadow_rays(shadows, radiance, recorder);
}

void PathLoop::trace_shadow_rays(std::size_t count, Color* radiance, PathRecorder* recorder) {
  Workspace& w = m_work;
  m_scene.embree.occluded(w.shadow_rays, count, w.shadowed);
  for (std::size_t k = 0; k < count; ++k) {
    if (w.shadowed[k]) continue;
    const std::uint32_t j = w.shadow_vertex[k], lane = w.vertex_lanes[j];
    const Color local = w.shadow_light.color(k);
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
  std::size_t kept = 0;
  for (std::size_t j = 0; j < m_vertices; ++j) {
    if (j + kScatterAhead < m_vertices) prefetch(w.scatter[j + kScatterAhead]);
    const std::uint32_t lane = w.vertex_lanes[j];
    const float inv_q = (weigh_lobe ? w.lobe.inv_q[j] : 1.0f) * (weigh_dir ? w.dir.inv_q[j] : 1.0f);
    const BsdfSample s = sample_bsdf(w.scatter[j], w.lobe.u0[j], {w.dir.u0[j], w.dir.u1[j]});
    if (recorder) {
      recorder->number(j, kLobe, w.lobe.u0[j]);
      recorder->number(j, kDir, w.dir.u0[j]);
      recorder->number(j, kDir + 1, w.dir.u1[j]);
      recorder->inv_q_scatter(j, inv_q);
      recorder->step(j, s.weight * inv_q);
    }
    const Color beta = w.beta.color(lane) * s.weight;
    if (is_zero(beta)) continue;
    w.beta.set(lane, {beta.x, beta.y, beta.z});
    w.weight[lane] *= inv_q;
    w.eta[lane] *= s.eta;
    w.previous.set(lane, w.position[j]);
    w.previous_pdf[lane] = s.delta ? 0.0f : s.pdf;
    if (!s.null) w.straight[lane] = 0;
    // The ray takes the place of ray `kept`, which has been used up; `subset` remembers its vertex.
    w.rays.set(kept, offset_point(w.position[j], w.ng[j], s.wo), s.wo, kEndless, w.time[j]);
    w.lanes[kept] = lane;
    w.subset[kept++] = static_cast<std::uint32_t>(j);
  }
  m_rays = kept;
}

// Ends paths with the renderer's own throughput, so that what a path contributes depends on its numbers alone.
void PathLoop::play_roulette(std::uint16_t bounce, PathRecorder* recorder) {
  Workspace& w = m_work;
  if (static_cast<int>(bounce) < m_rr_depth || m_rays == 0) return;
  if (m_needs_context)
    for (std::size_t k = 0; k < m_rays; ++k) w.subset_context.copy(k, w.context, w.subset[k]);
  const VertexContext context = w.subset_context.view();
  const bool weigh = draw({GroupKind::rr, bounce}, {w.lanes, m_rays}, m_needs_context ? &context : nullptr, w.roulette);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < m_rays; ++k) {
    const std::uint32_t lane = w.lanes[k];
    const Color beta = w.beta.color(lane);
    const float survival = smaller(max_component(beta) * sqr(w.eta[lane]), kMaxSurvival);
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

void PathLoop::emission(Color* radiance) {
  Workspace& w = m_work;
  std::fill_n(radiance, m_lanes, Color(0.0f));
  if (m_hide_emitters || m_max_depth == 0) return;
  SurfacePoint point;
  for (std::size_t i = 0; i < m_rays; ++i) {
    const std::uint32_t shape = w.hits.shape[i];
    Color emitted(0.0f);
    if (shape == kNoHit) {
      if (m_scene.emitters.has_environment()) emitted = m_scene.emitters.environment_radiance(w.rays.direction(i));
    } else if (const std::int32_t emitter = m_scene.surfaces.emitter(shape); emitter >= 0) {
      m_scene.surfaces.at(w.hits, i, w.rays, point);
      emitted = m_scene.emitters.radiance(emitter, point);
    }
    radiance[i] = emitted * w.weight[i];
  }
}

void PathLoop::first_hits(FirstHits& out) {
  Workspace& w = m_work;
  SurfacePoint point;
  for (std::size_t i = 0; i < m_rays; ++i) {
    out.albedo[i] = Color(0.0f);
    out.normal[i] = Vec3(0);
    out.distance[i] = 0;
    const std::uint32_t shape = w.hits.shape[i];
    if (shape == kNoHit) continue;
    const Vec3 position = m_scene.surfaces.at(w.hits, i, w.rays, point);
    m_scene.materials.at(m_scene.surfaces.bsdf(shape), point, w.scatter[0]);
    out.albedo[i] = albedo(w.scatter[0]);
    out.normal[i] = shading_normal(w.scatter[0]);
    out.distance[i] = (position - w.rays.origin(i)).length();
  }
}

}  // namespace warpath
