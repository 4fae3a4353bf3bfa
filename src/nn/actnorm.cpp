#include "nn/actnorm.h"

#include <algorithm>
#include <cmath>

#include "nn/dense.h"

namespace warpath::nn {

void initialise_actnorm(const ResidualNet& net, int blocks, const float* x, float* parameters) {
  const std::size_t width = static_cast<std::size_t>(net.width()), size = width * kBlock;
  const std::size_t count = static_cast<std::size_t>(blocks);
  // h: what the residual blocks hand on; a: the layer at work, before and after its ReLU.
  AlignedVector<float> h(count * size), a(count * size), packed;
  const float* from = x;
  for (std::size_t l = 0; l + 1 < net.layers().size(); ++l) {
    const DenseLayer& layer = net.layers()[l];
    if (!layer.normalised) return;
    const std::size_t inputs = static_cast<std::size_t>(layer.inputs) * kBlock;
    const bool closes_block = l > 0 && l % 2 == 0;
    float* gain = parameters + layer.gain;
    float* bias = parameters + layer.bias;
    packed.resize(static_cast<std::size_t>(packed_size(layer.inputs, layer.outputs)));
    AlignedVector<float> zero(static_cast<std::size_t>(layer.outputs), 0.0f);
    pack(layer.inputs, layer.outputs, parameters + layer.weight, nullptr, zero.data(), packed.data());
    for (std::size_t b = 0; b < count; ++b)
      dense(Epilogue::linear, layer.inputs, layer.outputs, packed.data(), from + b * inputs, a.data() + b * size);
    for (std::size_t o = 0; o < width; ++o) {
      double sum = 0, squares = 0;
      for (std::size_t b = 0; b < count; ++b)
        for (std::size_t s = 0; s < kBlock; ++s) {
          const double v = a[b * size + o * kBlock + s];
          sum += v;
          squares += v * v;
        }
      const double n = static_cast<double>(count * kBlock), mean = sum / n;
      const double variance = std::max(squares / n - mean * mean, 0.0);
      gain[o] = variance > 1e-12 ? static_cast<float>(1 / std::sqrt(variance)) : 1.0f;
      bias[o] = static_cast<float>(-mean * gain[o]);
      for (std::size_t b = 0; b < count; ++b)
        for (std::size_t s = 0; s < kBlock; ++s) {
          const std::size_t i = b * size + o * kBlock + s;
          a[i] = std::max(a[i] * gain[o] + bias[o] + (closes_block ? h[i] : 0.0f), 0.0f);
        }
    }
    if (l == 0 || closes_block) std::swap(h, a);
    from = l == 0 || closes_block ? h.data() : a.data();
  }
}

}  // namespace warpath::nn
