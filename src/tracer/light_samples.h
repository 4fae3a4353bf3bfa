#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tracer/ray_stream.h"
#include "tracer/vec3_array.h"

namespace warpath {

/// What light sampling made at the vertices of a batch, structure of arrays; an EmitterSample for each.
struct LightSamples {
  Vec3Array wo;      ///< unit
  float* distance;   ///< infinite for emitters at infinity
  float* pdf;        ///< solid angle, times the probability of the emitter's choice; infinite for delta emitters
  Vec3Array weight;  ///< radiance over pdf; 0 if nothing can arrive
};

/// Area emitters that are all rectangles at rest, each with one radiance: points on them for many vertices at once.
class RectangleLights {
 public:
  static constexpr std::size_t kMost = 16;
  struct Light {
    Vec3 corner, edge_u, edge_v;  ///< a point on it is corner + u edge_u + v edge_v
    Vec3 normal;                  ///< unit, on the side that emits
    Color radiance;
    float inverse_area;
    float choice_begin, probability;  ///< the share of [0, 1) that chooses it
  };
  explicit RectangleLights(std::span<const Light> lights);

  /// Points for vertices [0, n) at `from`. `choice` is null if there is one light. May write up to Arena::kPad entries
  /// beyond.
  void sample(std::size_t n, const Vec3Array& from, const float* choice, const float* u, const float* v,
              const LightSamples& samples) const;

  std::size_t size() const { return m_size; }
  /// The fields of Light, a column for each number.
  enum Column {
    corner = 0,
    edge_u = 3,
    edge_v = 6,
    normal = 9,
    radiance = 12,
    inverse_area = 15,
    choice_begin,
    probability,
    columns
  };
  const float* column(int i) const { return m_columns[i].data(); }

 private:
  std::size_t m_size;
  alignas(64) std::array<std::array<float, kMost>, columns> m_columns{};
};

/// Makes shadow rays of the samples at vertices [0, n) that would bring light: value and bsdf_pdf are the BSDF's
/// towards them, combined by the power heuristic; inv_q is null if all are 1. Ray i starts at vertex[i], and brings
/// light[i] (over the throughput of the path) if nothing is in its way. Returns how many there are. May write up to
/// Arena::kPad entries beyond.
std::size_t make_shadow_rays(std::size_t n, const Vec3Array& position, const Vec3Array& ng, const float* time,
                             const LightSamples& samples, const Vec3Array& value, const float* bsdf_pdf,
                             const float* inv_q, const RayStream& rays, const Vec3Array& light, std::uint32_t* vertex);

}  // namespace warpath
