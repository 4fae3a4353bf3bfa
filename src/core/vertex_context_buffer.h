#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/primary_source.h"

namespace warpath {

/// Position, normal, wi, albedo, roughness, film: see VertexContext.
using VertexValues = std::array<float, 15>;

/// One vertex of a VertexContext, to be kept.
struct Vertex {
  VertexValues values;
  std::uint32_t material;
  std::uint8_t kind;
  Vertex() = default;
  Vertex(const VertexContext& context, std::size_t i) : material(context.material[i]), kind(context.kind[i]) {
    for (std::size_t a = 0; a < 3; ++a) {
      values[a] = context.position[a][i];
      values[3 + a] = context.normal[a][i];
      values[6 + a] = context.wi[a][i];
      values[9 + a] = context.albedo[a][i];
    }
    values[12] = context.roughness[i];
    values[13] = context.film[0][i];
    values[14] = context.film[1][i];
  }
};

/// Vertices copied out of other contexts, one after the other.
class VertexContextBuffer {
 public:
  void clear() {
    for (auto& values : m_floats) values.clear();
    m_kind.clear();
    m_material.clear();
  }
  std::size_t size() const { return m_kind.size(); }
  void add(const VertexValues& values, std::uint8_t kind, std::uint32_t material) {
    for (std::size_t k = 0; k < values.size(); ++k) m_floats[k].push_back(values[k]);
    m_kind.push_back(kind);
    m_material.push_back(material);
  }
  /// Copies vertex i.
  void add(const VertexContext& context, std::size_t i) { add(Vertex(context, i)); }
  void add(const Vertex& vertex) { add(vertex.values, vertex.kind, vertex.material); }
  VertexContext view() const {
    VertexContext v;
    for (std::size_t a = 0; a < 3; ++a) {
      v.position[a] = m_floats[a].data();
      v.normal[a] = m_floats[3 + a].data();
      v.wi[a] = m_floats[6 + a].data();
      v.albedo[a] = m_floats[9 + a].data();
    }
    v.roughness = m_floats[12].data();
    v.kind = m_kind.data();
    v.material = m_material.data();
    v.film = {m_floats[13].data(), m_floats[14].data()};
    return v;
  }

 private:
  std::array<std::vector<float>, std::tuple_size_v<VertexValues>> m_floats;
  std::vector<std::uint8_t> m_kind;
  std::vector<std::uint32_t> m_material;
};

}  // namespace warpath
