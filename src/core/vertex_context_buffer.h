#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/primary_source.h"

namespace warpath {

/// Vertices copied out of other contexts, one after the other.
class VertexContextBuffer {
 public:
  void clear() {
    for (auto& values : m_floats) values.clear();
    m_kind.clear();
    m_material.clear();
  }
  std::size_t size() const { return m_kind.size(); }
  /// values: position, normal, wi, albedo, roughness.
  void add(const std::array<float, 13>& values, std::uint8_t kind, std::uint32_t material) {
    for (std::size_t k = 0; k < values.size(); ++k) m_floats[k].push_back(values[k]);
    m_kind.push_back(kind);
    m_material.push_back(material);
  }
  /// Copies vertex i.
  void add(const VertexContext& context, std::size_t i) {
    std::array<float, 13> values;
    for (std::size_t a = 0; a < 3; ++a) {
      values[a] = context.position[a][i];
      values[3 + a] = context.normal[a][i];
      values[6 + a] = context.wi[a][i];
      values[9 + a] = context.albedo[a][i];
    }
    values[12] = context.roughness[i];
    add(values, context.kind[i], context.material[i]);
  }
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
    return v;
  }

 private:
  std::array<std::vector<float>, 13> m_floats;
  std::vector<std::uint8_t> m_kind;
  std::vector<std::uint32_t> m_material;
};

}  // namespace warpath
