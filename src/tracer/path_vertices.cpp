// From hits to vertices: what rays met, and what is known there.
#include <algorithm>
#include <array>
#include <utility>

#include "tracer/path_loop.h"

namespace warpath {
namespace {

// Power heuristic with exponent 2 for the first of two strategies. [Veach 1997, 9.2.4]
float mis_weight(float pdf, float other) {
  const float a = pdf * pdf, b = other * other;
  const float weight = a / (a + b);
  return std::isfinite(weight) ? weight : 0.0f;
}

bool is_zero(const Color& c) { return c.x == 0 && c.y == 0 && c.z == 0; }

// How many hits before its turn the data of a hit is asked for.
constexpr std::size_t kTriangleAhead = 24, kVerticesAhead = 12, kTexturesAhead = 8;

}  // namespace

// Adds the emission that rays met, and makes vertices of the hits that scatter.
void PathLoop::resolve_hits(std::uint32_t bounce, Color* radiance, PathRecorder* recorder) {
  Workspace& w = m_work;
  const bool scatters = may_continue(bounce);
  const bool emits = bounce > 1;
  m_vertices = 0;
  const auto add = [&](std::uint32_t lane, const Color& emitted, float pdf) {
    if (m_hide_emitters && w.straight[lane]) return;
    const float previous_pdf = w.previous_pdf[lane];
    const Color local = emitted * (previous_pdf > 0 ? mis_weight(previous_pdf, pdf) : 1.0f);
    radiance[lane] += w.beta.color(lane) * local * w.weight[lane];
    if (recorder) recorder->emission(lane, local);
  };
  SurfacePoint point;
  for (std::size_t i = 0; i < m_rays; ++i) {
    const std::uint32_t lane = w.lanes[i], shape = w.hits.shape[i];
    if (shape == kNoHit) {
      if (!emits || !m_scene.emitters.has_environment()) continue;
      const Vec3 d = w.rays.direction(i);
      add(lane, m_scene.emitters.environment_radiance(d),
          w.previous_pdf[lane] > 0 ? m_scene.emitters.environment_pdf(d) : 0.0f);
      continue;
    }
    const std::int32_t emitter = m_scene.surfaces.emitter(shape);
    if (emits && emitter >= 0) {
      const Vec3 position = m_scene.surfaces.at(w.hits, i, w.rays, point);
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
    w.vertex_hit[j] = static_cast<std::uint32_t>(i);
    w.context.material[j] = static_cast<std::uint32_t>(m_scene.surfaces.bsdf(shape));
  }
  group_by_material();
  for (const Workspace::Group& group : w.groups)
    if (group.plain)
      resolve_plain(group);
    else
      resolve_any(group);
}

// Finds the order in which vertices are shaded: those of a material stand together.
void PathLoop::group_by_material() {
  Workspace& w = m_work;
  const std::uint32_t* material = w.context.material;
  w.groups.clear();
  w.group_of.resize(m_scene.scene.bsdfs.size());
  const auto find = [&](std::uint32_t m) -> Workspace::Group& { return w.groups[w.group_of[m] - 1]; };
  for (std::size_t j = 0; j < m_vertices; ++j) {
    const std::uint32_t m = material[j];
    if (w.group_of[m] == 0) {
      const auto bsdf = static_cast<BsdfId>(m);
      w.groups.push_back({bsdf, m_scene.materials.plain(bsdf), 0, 0});
      w.group_of[m] = static_cast<std::uint32_t>(w.groups.size());
    }
    ++find(m).end;
  }
  std::size_t begin = 0;
  for (Workspace::Group& group : w.groups) {
    group.begin = begin;
    begin += std::exchange(group.end, begin);
  }
  for (std::size_t j = 0; j < m_vertices; ++j) {
    w.rank[j] = static_cast<std::uint32_t>(find(material[j]).end++);
    w.order[w.rank[j]] = static_cast<std::uint32_t>(j);
  }
  for (const Workspace::Group& group : w.groups) w.group_of[static_cast<std::size_t>(group.bsdf)] = 0;
}

// What follows vertices of hits lies all over memory: without this, most of the time would be spent on waiting for it.
void PathLoop::prefetch_hits(std::size_t k, const Workspace::Group& group) const {
  const Workspace& w = m_work;
  const auto hit = [&](std::size_t v) { return w.vertex_hit[w.order[v]]; };
  if (k == group.begin)
    for (std::size_t v = k; v < std::min(group.end, k + kTriangleAhead); ++v)
      m_scene.surfaces.prefetch_triangle(w.hits, hit(v));
  if (k + kTriangleAhead < group.end) m_scene.surfaces.prefetch_triangle(w.hits, hit(k + kTriangleAhead));
  if (k + kVerticesAhead < group.end) m_scene.surfaces.prefetch_vertices(w.hits, hit(k + kVerticesAhead));
}

void PathLoop::resolve_point(std::size_t k, SurfacePoint& point) {
  Workspace& w = m_work;
  const std::uint32_t i = w.vertex_hit[w.order[k]];
  w.position.set(k, m_scene.surfaces.at(w.hits, i, w.rays, point));
  w.ng.set(k, point.ng);
  w.plain.wi.set(k, point.wi);
  w.time[k] = w.rays.time[i];
}

void PathLoop::resolve_plain(const Workspace::Group& group) {
  Workspace& w = m_work;
  const TextureId reflectance = group.plain->reflectance;
  const bool constant = m_scene.materials.is_constant(reflectance);
  SurfacePoint point;
  for (std::size_t k = group.begin; k < group.end; ++k) {
    prefetch_hits(k, group);
    resolve_point(k, point);
    w.plain.normal.set(k, point.ns);
    w.smooth[w.order[k]] = 1;
    if (constant) continue;
    m_scene.materials.prefetch(group.bsdf, point.uv);
    w.uv[0][k] = point.uv.x, w.uv[1][k] = point.uv.y;
  }
  if (constant) {
    const Color c = m_scene.materials.texture(reflectance, Vec2(0));
    for (std::size_t k = group.begin; k < group.end; ++k) w.plain.reflectance.set(k, {c.x, c.y, c.z});
    return;
  }
  for (std::size_t k = group.begin; k < group.end; ++k) {
    const Color c = m_scene.materials.texture(reflectance, {w.uv[0][k], w.uv[1][k]});
    w.plain.reflectance.set(k, {c.x, c.y, c.z});
  }
}

void PathLoop::resolve_any(const Workspace::Group& group) {
  Workspace& w = m_work;
  // Vertices whose textures have been asked for, and wait for them a while.
  std::array<SurfacePoint, kTexturesAhead> waiting;
  const auto resolve = [&](std::size_t k) {
    m_scene.materials.at(group.bsdf, waiting[k % kTexturesAhead], w.scatter[k]);
    w.smooth[w.order[k]] = w.scatter[k].smooth;
  };
  for (std::size_t k = group.begin; k < group.end; ++k) {
    prefetch_hits(k, group);
    if (k >= group.begin + kTexturesAhead) resolve(k - kTexturesAhead);
    SurfacePoint& point = waiting[k % kTexturesAhead];
    resolve_point(k, point);
    m_scene.materials.prefetch(group.bsdf, point.uv);
  }
  for (std::size_t k = group.end - std::min(group.end - group.begin, kTexturesAhead); k < group.end; ++k) resolve(k);
}

void PathLoop::fill_context() {
  Workspace& w = m_work;
  const ContextArrays& c = w.context;
  for (const Workspace::Group& group : w.groups) {
    for (std::size_t k = group.begin; k < group.end; ++k) {
      const std::uint32_t j = w.order[k];
      const Vec3 wi = w.plain.wi[k];
      set(c.position, j, w.position[k]);
      set(c.wi, j, wi);
      Color a;
      if (group.plain) {
        const Vec3 n = w.plain.normal[k];
        set(c.normal, j, n.dot(wi) < 0 ? -n : n);
        a = plain_albedo(*group.plain, n.dot(wi), w.plain.reflectance.color(k));
        c.roughness[j] = plain_roughness(*group.plain);
        c.kind[j] = static_cast<std::uint8_t>(plain_kind(*group.plain));
      } else {
        const Scatter& scatter = w.scatter[k];
        set(c.normal, j, shading_normal(scatter));
        a = albedo(scatter);
        c.roughness[j] = roughness(scatter);
        c.kind[j] = static_cast<std::uint8_t>(kind(scatter));
      }
      set(c.albedo, j, {a.x, a.y, a.z});
      const std::uint32_t lane = w.vertex_lanes[j];
      c.film[0][j] = w.film.u0[lane];
      c.film[1][j] = w.film.u1[lane];
      c.throughput[j] = luminance(w.beta.color(lane)) * w.weight[lane];
    }
  }
}

}  // namespace warpath
