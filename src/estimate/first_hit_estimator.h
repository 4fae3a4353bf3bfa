#pragma once
#include <cstdint>
#include <vector>

#include "tracer/tracer.h"

namespace warpath {

/// What the camera sees first, averaged in each pixel of the crop window (box filter), row-major.
struct FirstHitImages {
  std::vector<Color> albedo;
  std::vector<Color> normal;  ///< world space, x y z
  std::vector<float> depth;   ///< distance along the ray, scene units; mean over the rays that hit something
};

/// `rays` camera rays in each pixel.
FirstHitImages estimate_first_hits(const Tracer& tracer, int rays, std::uint64_t seed);

}  // namespace warpath
