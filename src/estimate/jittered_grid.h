#pragma once
#include <cstddef>

#include "core/math.h"

namespace warpath {

/// Rays of pixels, one in each cell of a grid inside each of them, and how batches take them: whole pixels, or whole
/// rows of a pixel's grid where that is too large for a batch.
class JitteredGrid {
 public:
  /// At least rays_per_pixel cells, in about as many rows as columns. Batches have at most `lanes` rays, or one row.
  JitteredGrid(int rays_per_pixel, std::size_t pixels, std::size_t lanes);

  std::size_t columns() const { return m_columns; }
  std::size_t cells() const { return m_columns * m_rows; }  ///< of a pixel
  std::size_t rays() const { return m_pixels * cells(); }   ///< pixel after pixel, row after row
  std::size_t batches() const;
  /// The first ray of a batch; batches() gives the end of the last one.
  std::size_t first_ray(std::size_t batch) const;
  /// Where in its pixel, [0,1)^2, a ray lies that is at u in [0,1)^2 of its cell.
  Vec2 place(std::size_t ray, const Vec2& u) const;

 private:
  std::size_t m_columns, m_rows, m_pixels;
  std::size_t m_lanes;              // of a batch that is not the last one
  std::size_t m_batches_per_pixel;  // 1 if a batch takes whole pixels
};

}  // namespace warpath
