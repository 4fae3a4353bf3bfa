#pragma once
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "scene/scene.h"
#include "tracer/area_light.h"
#include "tracer/environment.h"
#include "tracer/material.h"

namespace warpath {

/// A direction in which an emitter may be seen; whether it is, a shadow ray must tell.
struct EmitterSample {
  Vec3 wo;             ///< unit
  float distance = 0;  ///< infinite for emitters at infinity
  Color weight;        ///< radiance (or intensity / distance^2, or irradiance) over pdf
  float pdf = 0;       ///< solid angle, times the probability of the emitter's choice; for delta emitters that alone
  bool delta = false;  ///< BSDF sampling cannot meet it
};

/// The scene's lights. Immutable, thread-safe. Refers to the scene's shapes and textures.
class Emitters {
 public:
  /// Throws SceneError if there is more than one light at infinity with an extent.
  Emitters(const Scene& scene, std::span<const AnalyticShape* const> analytic, const Materials& materials);

  std::size_t size() const { return m_emitters.size(); }
  bool needs_choice() const { return size() > 1; }  ///< else the number that chooses is not used

  /// Light sampling: `choice` picks the emitter, uv the direction. False if nothing can arrive.
  bool sample(const Vec3& from, float choice, const Vec2& uv, float time, EmitterSample& sample) const;
  /// The same for the vertices [0, n) of a batch; choice is null if it is not needed. May write up to Arena::kPad
  /// entries beyond.
  void sample(std::size_t n, const Vec3Array& from, const float* choice, const float* u, const float* v,
              const float* time, const LightSamples& samples) const;

  /// Emitted radiance towards point.wi at a point on emitter `id`'s shape.
  Color radiance(std::int32_t id, const SurfacePoint& point) const;
  /// Density with which sample() makes the direction from `from` to `position`, a point on that shape.
  float pdf(std::int32_t id, const Vec3& from, const Vec3& position, const SurfacePoint& point, std::uint32_t primitive,
            float time) const;

  bool has_environment() const { return m_environment.has_value(); }
  Color environment_radiance(const Vec3& wo) const { return m_environment->radiance(wo); }
  float environment_pdf(const Vec3& wo) const { return m_environment->pdf(wo) * m_environment_probability; }

 private:
  struct Area {
    AreaLight light;
    Color constant;          // radiance, unless
    TextureId texture = -1;  // it is textured
  };
  struct Spot {
    Matrix4 to_local;
    Vec3 position;
    Color intensity;
    TextureId texture;
    float cutoff, cos_cutoff, cos_beam, inverse_transition, tan_cutoff;
  };
  struct Entry {
    enum class Kind : std::uint8_t { area, environment, point, spot, directional } kind;
    std::uint32_t index;  // into m_areas or m_spots
    float probability;
    Vec3 vector;  // position or direction
    Color color;
  };
  std::optional<RectangleLights> find_rectangles() const;
  Color spot_intensity(const Spot& spot, const Vec3& away) const;
  Color area_radiance(const Area& area, const Vec2& uv) const;

  const Materials& m_materials;
  std::vector<Entry> m_emitters;
  std::vector<Area> m_areas;
  std::vector<Spot> m_spots;
  std::optional<Environment> m_environment;
  float m_environment_probability = 0;
  DiscreteDistribution m_choice;
  std::optional<RectangleLights> m_rectangles;  // if that is all there is
};

}  // namespace warpath
