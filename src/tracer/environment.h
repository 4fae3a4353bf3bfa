#pragma once
#include <memory>

#include "scene/scene.h"
#include "tracer/distribution.h"

namespace warpath {

/// Light from all directions, far away: a constant, or an equirectangular image that is importance sampled.
/// Image convention, directions in the emitter's own space: theta from +y is v pi, the azimuth u 2 pi runs from -z over
/// +x; columns stand at texel centres and wrap around, rows reach from pole to pole.
class Environment {
 public:
  explicit Environment(const ConstantEmitter& emitter);
  explicit Environment(const EnvmapEmitter& emitter);

  /// wo: unit, away from the scene.
  Color radiance(const Vec3& wo) const;
  /// Solid-angle density with which sample() makes wo.
  float pdf(const Vec3& wo) const;
  /// A direction in proportion to the image's luminance; pdf is 0 if it failed.
  Vec3 sample(const Vec2& u, float& pdf) const;

 private:
  Color lookup(const Vec2& uv) const;
  Vec2 direction_to_uv(const Vec3& local) const;

  std::shared_ptr<const Image> m_image;  // null for a constant
  Color m_radiance{0.0f};
  float m_scale = 1;
  Matrix4 m_to_world, m_to_local;
  BilinearDistribution m_distribution;  // nodes at texel centres; u = 0 is the first of them
};

}  // namespace warpath
