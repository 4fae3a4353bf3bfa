#pragma once
#include <vector>

#include "scene/scene.h"

namespace warpath {

/// Value of the film's reconstruction filter along one axis, `x` pixels from the centre; filters are separable.
/// Formulas and truncation are Mitsuba 3's. 0 beyond the radius.
float filter_weight(const ReconstructionFilter& filter, float x);

/// For each of `size` pixels in a row: the integral of the filter, centred at the pixel, over [0, size]. What lies
/// outside the film takes no samples, so it is missing from the weights of pixels at the border.
std::vector<double> filter_integrals(const ReconstructionFilter& filter, int size);

}  // namespace warpath
