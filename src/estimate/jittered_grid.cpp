#include "estimate/jittered_grid.h"

#include <algorithm>
#include <cmath>

namespace warpath {

JitteredGrid::JitteredGrid(int rays_per_pixel, std::size_t pixels, std::size_t lanes) : m_pixels(pixels) {
  const auto rays = static_cast<std::size_t>(rays_per_pixel);
  m_columns = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(rays))));
  m_rows = (rays + m_columns - 1) / m_columns;
  m_lanes = cells() <= lanes ? lanes / cells() * cells() : std::max<std::size_t>(1, lanes / m_columns) * m_columns;
  m_batches_per_pixel = (cells() + m_lanes - 1) / m_lanes;
}

std::size_t JitteredGrid::batches() const {
  return m_batches_per_pixel > 1 ? m_pixels * m_batches_per_pixel : (rays() + m_lanes - 1) / m_lanes;
}

std::size_t JitteredGrid::first_ray(std::size_t batch) const {
  if (m_batches_per_pixel == 1) return std::min(rays(), batch * m_lanes);
  return batch / m_batches_per_pixel * cells() + batch % m_batches_per_pixel * m_lanes;
}

Vec2 JitteredGrid::place(std::size_t ray, const Vec2& u) const {
  const std::size_t cell = ray % cells(), column = cell % m_columns, row = cell / m_columns;
  return {(static_cast<float>(column) + u.x) / static_cast<float>(m_columns),
          (static_cast<float>(row) + u.y) / static_cast<float>(m_rows)};
}

}  // namespace warpath
