#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "path/primary_source.h"
#include "tracer/light_samples.h"
#include "tracer/plain_bsdf.h"
#include "tracer/ray_stream.h"
#include "tracer/scatter.h"
#include "tracer/vec3_array.h"

namespace warpath {

/// Memory for one batch, cut into arrays of one length. Grows, never shrinks.
class Arena {
 public:
  /// How many entries beyond the end of each array may be written, too.
  static constexpr std::size_t kPad = 16;

  /// Starts over with arrays of at least n entries.
  void reset(std::size_t n);
  template <class T>
  T* take() {
    static_assert(sizeof(T) <= sizeof(float));
    return static_cast<T*>(next());
  }

 private:
  void* next();

  // With the pad, arrays of a power-of-two length do not all fall into the same cache sets.
  static constexpr std::size_t kArrays = 164;
  std::size_t m_stride = 0, m_used = 0, m_capacity = 0;
  std::unique_ptr<float[]> m_memory;
};

/// Numbers of a group as they were drawn.
struct DrawnNumbers {
  float *u0, *u1, *inv_q;
};

/// What a VertexContext points to.
struct ContextArrays : VertexFields<float*, std::uint8_t*, std::uint32_t*> {
  float* throughput = nullptr;
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

  // One entry per vertex, in the order of their paths, in which numbers are drawn.
  std::uint32_t* vertex_lanes;  ///< its path
  std::uint32_t* vertex_hit;    ///< the ray that met it
  std::uint8_t* smooth;
  ContextArrays context;
  DrawnNumbers film, lens, shutter, light, light_uv, lobe, dir, roulette;
  float* survival;      ///< probability with which the renderer's roulette lets a ray go on
  std::uint32_t* slot;  ///< its place among the smooth ones
  std::uint32_t* rank;  ///< its place in the order below

  // The same vertices in the order in which they are shaded: grouped by material. order[k] is the place of the k-th in
  // the arrays above.
  struct Group {
    BsdfId bsdf;
    const PlainBsdf* plain;  ///< null if it is more than that: such vertices have a Scatter
    std::size_t begin, end;
  };
  std::vector<Group> groups;
  std::vector<std::uint32_t> group_of;  ///< BSDF -> one more than its place in groups; 0 between bounces
  std::uint32_t* order;
  Vec3Array position, ng;
  float* time;
  PlainVertices plain;
  float* uv[2];
  std::vector<Scatter> scatter;
  float* ordered_choice;  ///< numbers in this order: which light, or which lobe
  DrawnNumbers ordered;   ///< and of a group of two
  LightSamples samples;
  Vec3Array value;  ///< of the BSDF towards a light; or what the throughput is multiplied with
  float* pdf;
  float* step_eta;            ///< relative index of refraction on the way that BSDF sampling took
  std::uint8_t* straight_on;  ///< 1 if that was a null lobe's

  // Subsets of the vertices: subset[i] is a vertex, subset_lanes[i] its path.
  std::uint32_t *subset, *subset_lanes;
  ContextArrays subset_context;

  // One entry per shadow ray.
  RayStream shadow_rays;
  std::uint32_t* shadow_vertex;
  Vec3Array shadow_light;  ///< what arrives if nothing is in between, over the throughput of the path
  std::uint8_t* shadowed;

  // One entry per camera ray that goes on beyond a hidden emitter.
  std::uint32_t* passing;  ///< its ray
  RayStream passing_rays;
  HitStream passing_hits;

 private:
  Arena m_arena;
};

}  // namespace warpath
