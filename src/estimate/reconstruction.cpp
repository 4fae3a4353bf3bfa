#include "estimate/reconstruction.h"

#include <algorithm>
#include <cmath>

namespace warpath {

float filter_weight(const ReconstructionFilter& filter, float x) {
  using Type = ReconstructionFilter::Type;
  x = std::fabs(x);
  switch (filter.type) {
    case Type::box:
      return x <= filter.radius ? 1.0f : 0.0f;
    case Type::tent:
      return std::max(0.0f, 1 - x / filter.radius);
    case Type::gaussian: {
      // Shifted so that it reaches 0 at the radius.
      const float alpha = -1 / (2 * filter.stddev * filter.stddev);
      return std::max(0.0f, std::exp(alpha * x * x) - std::exp(alpha * filter.radius * filter.radius));
    }
    case Type::mitchell: {
      // Mitchell and Netravali 1988, eq. 8, on [-2, 2].
      x *= 2 / filter.radius;
      const float b = filter.b, c = filter.c, x2 = x * x, x3 = x2 * x;
      if (x < 1) return ((12 - 9 * b - 6 * c) * x3 + (-18 + 12 * b + 6 * c) * x2 + (6 - 2 * b)) / 6;
      if (x < 2) return ((-b - 6 * c) * x3 + (6 * b + 30 * c) * x2 + (-12 * b - 48 * c) * x + (8 * b + 24 * c)) / 6;
      return 0;
    }
  }
  return 0;
}

std::vector<double> filter_integrals(const ReconstructionFilter& filter, int size) {
  std::vector<double> integrals(static_cast<std::size_t>(size));
  // Midpoint rule, fine enough for float weights; only pixels within a radius of the border differ from the middle one.
  constexpr int kSteps = 2000;
  for (int i = 0; i < size; ++i) {
    const double centre = i + 0.5;
    const double begin = std::max(0.0, centre - filter.radius), end = std::min<double>(size, centre + filter.radius);
    const double step = (end - begin) / kSteps;
    double sum = 0;
    for (int k = 0; k < kSteps; ++k)
      sum += filter_weight(filter, static_cast<float>(begin + (k + 0.5) * step - centre)) * step;
    integrals[static_cast<std::size_t>(i)] = sum;
  }
  return integrals;
}

}  // namespace warpath
