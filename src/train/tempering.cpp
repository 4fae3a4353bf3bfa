#include "train/tempering.h"

#include <cmath>

namespace warpath {
namespace {

double power(float weight, double b) { return weight > 0 ? std::pow(static_cast<double>(weight), b) : 0.0; }

}  // namespace

double effective_samples(std::span<const float> weight, double b) {
  double sum = 0, square = 0;
  for (const float w : weight) {
    const double value = power(w, b);
    sum += value;
    square += value * value;
  }
  return square > 0 ? sum * sum / square : 0;
}

double tempering(std::span<const float> weight, double effective) {
  // As b falls to 0 the effective samples rise to all those that weigh anything, if they rise at all.
  double low = 0, high = 1;
  for (int i = 0; i < 20; ++i) {
    const double b = 0.5 * (low + high);
    (effective_samples(weight, b) < effective ? high : low) = b;
  }
  return 0.5 * (low + high);
}

Examples tempered(const Examples& examples, double effective) {
  const double b = tempering(examples.weight, effective);
  Examples result = examples;
  for (float& w : result.weight) w = static_cast<float>(power(w, b));
  return result;
}

}  // namespace warpath
