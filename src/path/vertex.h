#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace warpath {

/// What the tracer knows of a surface's scattering where a number is drawn.
enum class SurfaceKind : std::uint8_t { none, diffuse, glossy, mixed, delta, null };

/// What is known of a vertex: the one layout of a single vertex, of arrays of them, and of pointers into such arrays.
template <class Float, class Kind, class Material>
struct VertexFields {
  std::array<Float, 3> position{};  ///< world space, scene units
  std::array<Float, 3> normal{};    ///< shading normal, unit, on the side of wi
  std::array<Float, 3> wi{};        ///< unit, towards the previous vertex
  std::array<Float, 3> albedo{};    ///< approximate reflectance, linear RGB
  Float roughness{};                ///< 0 delta ... 1 diffuse
  std::array<Float, 2> film{};      ///< where the path began, in [0,1) of the whole film
  Kind kind{};                      ///< SurfaceKind
  Material material{};              ///< index of the BSDF in the scene
};

/// Calls f with each field of a and the same one of b.
template <class A, class B, class F>
void for_each_field(A&& a, B&& b, const F& f) {
  for (std::size_t k = 0; k < 3; ++k) {
    f(a.position[k], b.position[k]);
    f(a.normal[k], b.normal[k]);
    f(a.wi[k], b.wi[k]);
    f(a.albedo[k], b.albedo[k]);
  }
  f(a.roughness, b.roughness);
  for (std::size_t k = 0; k < 2; ++k) f(a.film[k], b.film[k]);
  f(a.kind, b.kind);
  f(a.material, b.material);
}

using Vertex = VertexFields<float, std::uint8_t, std::uint32_t>;

/// What the tracer shows at a vertex when it draws numbers for a batch. Structure of arrays; entry i belongs to
/// lanes[i] of the draw. Every array has one entry per drawn lane.
struct VertexContext : VertexFields<const float*, const std::uint8_t*, const std::uint32_t*> {
  /// Luminance of what light that leaves the vertex is multiplied with on its way to the film, 1 / q included.
  const float* throughput = nullptr;
  /// For roulette only: the path goes on if its number is less than this. In (0,1).
  const float* survival = nullptr;

  /// The same without its first `count` entries.
  VertexContext from(std::size_t count) const;
  /// Entry i by itself.
  Vertex at(std::size_t i) const;
};

/// Vertices that are kept, one after the other.
class VertexBuffer {
 public:
  void clear();
  std::size_t size() const { return m_arrays.kind.size(); }
  void add(const Vertex& vertex);
  /// Holds the first n entries of a context, and nothing else.
  void assign(const VertexContext& context, std::size_t n);
  VertexContext view() const;

 private:
  VertexFields<std::vector<float>, std::vector<std::uint8_t>, std::vector<std::uint32_t>> m_arrays;
};

}  // namespace warpath
