#include "tracer/emitters.h"

#include "tracer/sampling.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kDegrees = kPi / 180;

}  // namespace

Emitters::Emitters(const Scene& scene, std::span<const AnalyticShape* const> analytic, const Materials& materials)
    : m_materials(materials) {
  std::vector<float> weights;
  for (const Emitter& emitter : scene.emitters) weights.push_back(emitter.sampling_weight);
  m_choice = DiscreteDistribution(weights);
  for (std::size_t i = 0; i < scene.emitters.size(); ++i) {
    const Emitter& emitter = scene.emitters[i];
    Entry& entry = m_emitters.emplace_back();
    entry.probability = m_choice.probability(i);
    const auto add_environment = [&](const auto& model) {
      if (m_environment)
        throw SceneError(fmt::format("{}: only one environment emitter (constant or envmap) can light a scene",
                                     scene.file.string()));
      m_environment.emplace(model);
      m_environment_probability = entry.probability;
      entry.kind = Entry::Kind::environment;
    };
    if (const auto* area = std::get_if<AreaEmitter>(&emitter.model)) {
      const Texture& texture = scene.textures[static_cast<std::size_t>(area->radiance)];
      entry.kind = Entry::Kind::area;
      entry.index = static_cast<std::uint32_t>(m_areas.size());
      const auto* constant = std::get_if<ConstantTexture>(&texture);
      const auto shape = static_cast<std::size_t>(area->shape);
      m_areas.push_back({AreaLight(scene.shapes[shape], analytic[shape], area->radiance, texture, materials),
                         constant ? constant->value : Color(0.0f), constant ? -1 : area->radiance});
    } else if (const auto* envmap = std::get_if<EnvmapEmitter>(&emitter.model)) {
      add_environment(*envmap);
    } else if (const auto* constant = std::get_if<ConstantEmitter>(&emitter.model)) {
      add_environment(*constant);
    } else if (const auto* point = std::get_if<PointEmitter>(&emitter.model)) {
      entry.kind = Entry::Kind::point;
      entry.vector = point->position;
      entry.color = point->intensity;
    } else if (const auto* spot = std::get_if<SpotEmitter>(&emitter.model)) {
      entry.kind = Entry::Kind::spot;
      entry.index = static_cast<std::uint32_t>(m_spots.size());
      const float cutoff = spot->cutoff_angle * kDegrees, beam = spot->beam_width * kDegrees;
      m_spots.push_back({spot->to_world.inverse(), transform_point(spot->to_world, {0, 0, 0}), spot->intensity,
                         spot->texture, cutoff, std::cos(cutoff), std::cos(beam), 1 / (cutoff - beam),
                         std::tan(cutoff)});
    } else {
      const auto& directional = std::get<DirectionalEmitter>(emitter.model);
      entry.kind = Entry::Kind::directional;
      entry.vector = -directional.direction;
      entry.color = directional.irradiance;
    }
  }
  m_rectangles = find_rectangles();
}

std::optional<RectangleLights> Emitters::find_rectangles() const {
  std::vector<RectangleLights::Light> lights(m_emitters.size());
  if (lights.empty() || lights.size() > RectangleLights::kMost) return {};
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const Entry& entry = m_emitters[i];
    if (entry.kind != Entry::Kind::area || !m_areas[entry.index].light.is_plain_rectangle(lights[i])) return {};
    lights[i].radiance = m_areas[entry.index].constant;
    lights[i].choice_begin = m_choice.begin(i);
    lights[i].probability = entry.probability;
  }
  return RectangleLights(lights);
}

Color Emitters::area_radiance(const Area& area, const Vec2& uv) const {
  return area.texture < 0 ? area.constant : m_materials.texture(area.texture, uv);
}

Color Emitters::spot_intensity(const Spot& spot, const Vec3& away) const {
  const Vec3 local = transform_vector(spot.to_local, away).normalized();
  if (!(local.z > spot.cos_cutoff)) return Color(0.0f);
  const float falloff =
      local.z >= spot.cos_beam ? 1.0f : (spot.cutoff - std::acos(smaller(local.z, 1.0f))) * spot.inverse_transition;
  Color intensity = spot.intensity * falloff;
  if (spot.texture >= 0) {
    const float scale = 0.5f / (local.z * spot.tan_cutoff);
    intensity *= m_materials.texture(spot.texture, {0.5f + local.x * scale, 0.5f + local.y * scale});
  }
  return intensity;
}

bool Emitters::sample(const Vec3& from, float choice, const Vec2& uv, float time, EmitterSample& sample) const {
  if (m_emitters.empty()) return false;
  float rest;
  const Entry& entry = m_emitters[needs_choice() ? m_choice.sample(choice, rest) : 0];
  sample.delta = false;
  switch (entry.kind) {
    case Entry::Kind::area: {
      const Area& area = m_areas[entry.index];
      LightPoint point;
      if (!area.light.sample(from, uv, time, point)) return false;
      if (!(point.wo.dot(point.ns) < 0)) return false;
      sample.wo = point.wo;
      sample.distance = point.distance;
      sample.pdf = point.pdf * entry.probability;
      sample.weight = area_radiance(area, point.uv) * (1 / sample.pdf);
      return true;
    }
    case Entry::Kind::environment: {
      float pdf;
      sample.wo = m_environment->sample(uv, pdf);
      if (!(pdf > 0)) return false;
      sample.distance = kInfinity;
      sample.pdf = pdf * entry.probability;
      sample.weight = m_environment->radiance(sample.wo) * (1 / sample.pdf);
      return true;
    }
    case Entry::Kind::point:
    case Entry::Kind::spot: {
      const bool is_point = entry.kind == Entry::Kind::point;
      const Vec3 d = (is_point ? entry.vector : m_spots[entry.index].position) - from;
      sample.distance = d.length();
      if (!(sample.distance > 0)) return false;
      sample.wo = d / sample.distance;
      const Color intensity = is_point ? entry.color : spot_intensity(m_spots[entry.index], -sample.wo);
      sample.weight = intensity / (sqr(sample.distance) * entry.probability);
      break;
    }
    case Entry::Kind::directional:
      sample.wo = entry.vector;
      sample.distance = kInfinity;
      sample.weight = entry.color / entry.probability;
      break;
  }
  sample.pdf = entry.probability;
  sample.delta = true;
  return true;
}

void Emitters::sample(std::size_t n, const Vec3Array& from, const float* choice, const float* u, const float* v,
                      const float* time, const LightSamples& samples) const {
  if (m_rectangles) return m_rectangles->sample(n, from, choice, u, v, samples);
  EmitterSample s;
  for (std::size_t k = 0; k < n; ++k) {
    if (!sample(from[k], choice ? choice[k] : 0.0f, {u[k], v[k]}, time[k], s)) {
      samples.weight.set(k, Vec3(0));
      continue;
    }
    samples.wo.set(k, s.wo);
    samples.distance[k] = s.distance;
    samples.pdf[k] = s.delta ? kInfinity : s.pdf;
    samples.weight.set(k, {s.weight.x, s.weight.y, s.weight.z});
  }
}

Color Emitters::radiance(std::int32_t id, const SurfacePoint& point) const {
  if (!(point.ns.dot(point.wi) > 0)) return Color(0.0f);
  return area_radiance(m_areas[m_emitters[static_cast<std::size_t>(id)].index], point.uv);
}

float Emitters::pdf(std::int32_t id, const Vec3& from, const Vec3& position, const SurfacePoint& point,
                    std::uint32_t primitive, float time) const {
  const Entry& entry = m_emitters[static_cast<std::size_t>(id)];
  return m_areas[entry.index].light.pdf(from, position, point.ng, point.uv, primitive, time) * entry.probability;
}

}  // namespace warpath
