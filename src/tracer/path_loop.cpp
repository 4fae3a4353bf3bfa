#include "tracer/path_loop.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

namespace warpath {
namespace {

constexpr float kEndless = std::numeric_limits<float>::max();
constexpr std::uint32_t kLastBounce = 0xffff;  // what a Group can name

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
  const RayStream& rays = w.passing_rays;
  const HitStream& hits = w.passing_hits;
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
      w.passing[count++] = static_cast<std::uint32_t>(i);
    }
    if (count == 0) return;
    m_scene.embree.intersect(rays, count, hits, false);
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t i = w.passing[k];
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
