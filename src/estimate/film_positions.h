#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/math.h"
#include "estimate/film.h"
#include "tracer/tracer.h"

namespace warpath {

/// A film number in [0,1) from a pixel (column or row), an offset in [0,1) inside it, and the size of the film in
/// pixels. Rounding never carries it into the next pixel.
inline float film_position(std::uint32_t pixel, float offset, int size) {
  const float lowest = static_cast<float>(pixel), next = std::nextafter(lowest + 1, 0.0f);
  return std::min(std::min(lowest + offset, next) / static_cast<float>(size), kOneMinusEpsilon);
}

/// From offsets in [0,1) inside a pixel of the crop window (row-major) to film numbers, in place.
inline void place_in_pixel(const FilmSettings& film, std::uint32_t pixel, float& x, float& y) {
  const auto width = static_cast<std::uint32_t>(film.crop_width);
  x = film_position(pixel % width, x, film.crop_width);
  y = film_position(pixel / width, y, film.crop_height);
}

/// Path `lane` as a film of these settings takes it: from the corner of the crop window.
inline Film::Sample film_sample(const FilmSettings& film, const PathResults& results, std::size_t lane) {
  return {results.film_x[lane] - static_cast<float>(film.crop_x),
          results.film_y[lane] - static_cast<float>(film.crop_y), results.radiance[lane]};
}

/// The pixels of a crop window in the order in which they are rendered: square tiles, so that the camera rays of a
/// batch are coherent.
std::vector<std::uint32_t> tiled_pixels(int width, int height);

}  // namespace warpath
