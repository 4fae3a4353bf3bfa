#pragma once
#include <array>
#include <map>
#include <memory>
#include <tuple>

#include "scene/bsdf.h"

namespace warpath {

/// How much light passes a rough dielectric surface from outside, by the cosine of its direction; 64 nodes, linear
/// between them, as Mitsuba's roughplastic has it. Empty until assigned from make_rough_transmittance.
class RoughTransmittance {
 public:
  static constexpr int kNodes = 64;
  using Table = std::array<float, kNodes>;
  RoughTransmittance() = default;
  explicit RoughTransmittance(std::shared_ptr<const Table> table) : m_table(std::move(table)) {}
  const float* nodes() const { return m_table ? m_table->data() : nullptr; }
  float operator()(float cos_theta) const {
    const float x = cos_theta * (kNodes - 1);
    const int i = x < kNodes - 2 ? static_cast<int>(x) : kNodes - 2;
    const float t = x - static_cast<float>(i);
    return (*m_table)[i] * (1 - t) + (*m_table)[i + 1] * t;
  }

 private:
  std::shared_ptr<const Table> m_table;
};

struct RoughInterface {
  RoughTransmittance external_transmittance;
  float internal_reflectance;  ///< of diffuse light from within
};
/// Integrates the reflection and refraction of a rough interface; takes some milliseconds. eta > 0, not 1.
RoughInterface make_rough_interface(MicrofacetType distribution, float alpha, float eta);

/// Rough interfaces as they are asked for, each made once.
class RoughInterfaces {
 public:
  const RoughInterface& get(MicrofacetType distribution, float alpha, float eta);

 private:
  std::map<std::tuple<MicrofacetType, float, float>, RoughInterface> m_made;
};

}  // namespace warpath
