#pragma once
#include <array>
#include <cstddef>

#include "core/math.h"

namespace warpath {

/// Vectors or colours, structure of arrays.
struct Vec3Array {
  float *x, *y, *z;
  Vec3 operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
  void set(std::size_t i, const Vec3& v) const { x[i] = v.x, y[i] = v.y, z[i] = v.z; }
  Color color(std::size_t i) const { return {x[i], y[i], z[i]}; }
  std::array<const float*, 3> pointers() const { return {x, y, z}; }
};

inline void set(const std::array<float*, 3>& arrays, std::size_t i, const Vec3& v) {
  arrays[0][i] = v.x, arrays[1][i] = v.y, arrays[2][i] = v.z;
}

}  // namespace warpath
