#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "scene/scene.h"
#include "tracer/analytic_shape.h"
#include "tracer/ray_stream.h"

namespace warpath {

/// The acceleration structure over a scene's shapes. Nothing but this class's source knows which ray tracing library
/// and version it is. Immutable, thread-safe.
class EmbreeScene {
 public:
  /// Shares the vertex and index buffers of `shapes`: they must outlive it and stay where they are. analytic[i] is
  /// shape i where that is a sphere, disk or cylinder. Builds in parallel on the caller's TBB arena.
  EmbreeScene(std::span<const Shape> shapes, std::span<const AnalyticShape* const> analytic);
  ~EmbreeScene();
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  /// Closest hits of rays [0, n). coherent: neighbouring rays run alike, as those of a camera do.
  void intersect(const RayStream& rays, std::size_t n, const HitStream& hits, bool coherent) const;
  /// occluded[i] = 1 if anything is hit before t_max.
  void occluded(const RayStream& rays, std::size_t n, std::uint8_t* occluded) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> m_impl;
};

}  // namespace warpath
