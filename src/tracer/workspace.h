#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/primary_source.h"
#include "tracer/ray_stream.h"
#include "tracer/scatter.h"

namespace warpath {

/// Memory for one batch, cut into arrays of one length. Grows, never shrinks.
class Arena {
 public:
  /// Starts over with arrays of at least n entries.
  void reset(std::size_t n);
  template <class T>
  T* take() {
    static_assert(sizeof(T) <= sizeof(float));
    return static_cast<T*>(next());
  }

 private:
  void* next();

  // Arrays of a power-of-two length would all fall into the same cache sets.
  static constexpr std::size_t kPad = 16, kArrays = 112;
  std::size_t m_stride = 0, m_used = 0, m_capacity = 0;
  std::unique_ptr<float[]> m_memory;
};

struct Vec3Array {
  float *x, *y, *z;
  Vec3 operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
  void set(std::size_t i, const Vec3& v) const { x[i] = v.x, y[i] = v.y, z[i] = v.z; }
  Color color(std::size_t i) const { return {x[i], y[i], z[i]}; }
  std::array<const float*, 3> pointers() const { return {x, y, z}; }
};

/// Numbers of a group as they were drawn.
struct DrawnNumbers {
  float *u0, *u1, *inv_q;
};

/// What a VertexContext points to.
struct ContextArrays {
  Vec3Array position, normal, wi, albedo;
  float* roughness;
  std::uint8_t* kind;
  std::uint32_t* material;
  VertexContext view() const;
  void copy(std::size_t to, const ContextArrays& source, std::size_t from) const;
};

/// All arrays of a batch on its way through the scene. One for each thread, used again for every batch.
struct Workspace {
  void resize(std::size_t lanes);

  // One entry per lane of the batch.
  Vec3Array beta;          ///< the renderer's own throughput
  float* weight;           ///< product of the inv_q of all numbers that shaped the path so far
  float* eta;              ///< product of the relative indices of refraction
  Vec3Array previous;      ///< position of the vertex before
  float* previous_pdf;     ///< with which its BSDF made the ray; 0 marks a direction that light sampling cannot make
  std::uint8_t* straight;  ///< 1 until the path is scattered other than straight through

  // One entry per ray: the path lanes[i].
  std::uint32_t* lanes;
  RayStream rays;
  HitStream hits;

  // One entry per vertex: the path vertex_lanes[i].
  std::uint32_t* vertex_lanes;
  Vec3Array position, ng;
  float* time;
  std::vector<Scatter> scatter;
  ContextArrays context;
  DrawnNumbers film, lens, shutter, light, light_uv, lobe, dir, roulette;

  // Subsets of the vertices: subset[i] is a vertex, subset_lanes[i] its path.
  std::uint32_t *subset, *subset_lanes;
  ContextArrays subset_context;

  // One entry per shadow ray.
  RayStream shadow_rays;
  std::uint32_t* shadow_vertex;
  Vec3Array shadow_light;  ///< what arrives if nothing is in between, over the throughput of the path
  std::uint8_t* shadowed;

 private:
  Arena m_arena;
};

}  // namespace warpath
