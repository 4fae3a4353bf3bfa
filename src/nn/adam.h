#pragma once
#include <cstddef>

namespace warpath::nn {

/// Adam (Kingma and Ba 2015) with their defaults.
struct Adam {
  float rate = 1e-3f, beta1 = 0.9f, beta2 = 0.999f, epsilon = 1e-8f;
};

/// Step number `step` (1, 2, ...) for parameters [0, count): p -= rate * m^ / (sqrt(v^) + epsilon), with bias
/// correction. All arrays are aligned to 64 bytes and count is a multiple of 16.
void adam_step(const Adam& adam, int step, std::size_t count, const float* gradient, float* parameter, float* m,
               float* v);

/// a[i] += sum over the other slots of a[slot * stride + i], slot by slot: the same order for any number of threads.
void add_slots(int slots, std::size_t stride, std::size_t count, float* a);

/// average += weight * (parameter - average).
void move_average(float weight, std::size_t count, const float* parameter, float* average);

}  // namespace warpath::nn
