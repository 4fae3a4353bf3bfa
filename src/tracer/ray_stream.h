#pragma once
#include <cstdint>
#include <limits>

#include "core/math.h"

namespace warpath {

/// Rays, structure of arrays. Directions are unit; a ray starts at its origin and ends at t_max.
struct RayStream {
  float *ox, *oy, *oz;
  float *dx, *dy, *dz;
  float* t_max;
  float* time;  ///< within the shutter, 0 to 1

  Vec3 origin(std::size_t i) const { return {ox[i], oy[i], oz[i]}; }
  Vec3 direction(std::size_t i) const { return {dx[i], dy[i], dz[i]}; }
  void set(std::size_t i, const Vec3& o, const Vec3& d, float end, float at) const {
    ox[i] = o.x, oy[i] = o.y, oz[i] = o.z;
    dx[i] = d.x, dy[i] = d.y, dz[i] = d.z;
    t_max[i] = end, time[i] = at;
  }
};

inline constexpr std::uint32_t kNoHit = 0xffffffffu;

/// Closest hits, structure of arrays.
struct HitStream {
  float* t;
  float *u, *v;  ///< on a triangle: barycentric weights of its second and third vertex
  float *nx, *ny,
      *nz;  ///< geometric normal, not unit, as the triangle's winding gives it; undefined on analytic shapes
  std::uint32_t* shape;  ///< index into Scene::shapes, kNoHit where nothing was hit; the rest is then undefined
  std::uint32_t* primitive;
};

}  // namespace warpath
