#include "nn/residual_net.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/rng.h"
#include "nn/dense.h"
#include "nn/dense_bf16.h"
#include "warpath/error.h"

namespace warpath::nn {

Products fastest_products() { return bf16::available() ? Products::bf16 : Products::floats; }

ResidualNet::ResidualNet(int inputs, int width, int blocks, int outputs, Norm norm, Products products)
    : m_width(width), m_norm(norm), m_products(products) {
  if (width < 16 || width % 16 != 0) throw ConfigError(fmt::format("width {}: must be a multiple of 16", width));
  if (blocks < 0) throw ConfigError(fmt::format("blocks {}: must not be negative", blocks));
  // Constants need no more than a bias.
  const int hidden = inputs == 0 && norm == Norm::none ? 0 : 1 + 2 * blocks;
  if (hidden == 0) m_products = Products::floats;
  for (int l = 0; l <= hidden; ++l) {
    DenseLayer layer;
    layer.inputs = l == 0 ? inputs : width;
    layer.outputs = l == hidden ? outputs : width;
    layer.normalised = l < hidden && norm != Norm::none;
    const auto take = [](std::size_t& total, int count) {
      return std::exchange(total, total + static_cast<std::size_t>(round_up(count, 16)));
    };
    layer.weight = take(m_parameters, layer.outputs * padded_inputs(layer.inputs));
    layer.bias = take(m_parameters, layer.outputs);
    if (layer.normalised) layer.gain = take(m_parameters, layer.outputs);
    if (layer.normalised && norm == Norm::batch) {
      layer.mean = take(m_parameters, layer.outputs);
      layer.variance = take(m_parameters, layer.outputs);
    }
    layer.packed = take(m_packed, packed_size(layer.inputs, layer.outputs));
    layer.packed_back = take(m_packed_back, packed_size(layer.outputs, layer.inputs));
    m_layers.push_back(layer);
  }
}

std::size_t ResidualNet::multiply_adds() const {
  std::size_t sum = 0;
  for (const DenseLayer& l : m_layers) sum += static_cast<std::size_t>(l.inputs) * static_cast<std::size_t>(l.outputs);
  return sum;
}

void ResidualNet::initialise(float* parameters, std::uint64_t key, float last) const {
  std::fill_n(parameters, m_parameters, 0.0f);
  std::uint32_t counter = 0;
  for (const DenseLayer& l : m_layers) {
    const float scale =
        (&l == &m_layers.back() ? last : 1.0f) * std::sqrt(6.0f / static_cast<float>(std::max(l.inputs, 1)));
    for (int o = 0; o < l.outputs; ++o)
      for (int k = 0; k < l.inputs; ++k)
        parameters[l.weight + static_cast<std::size_t>(o * padded_inputs(l.inputs) + k)] =
            scale * (2 * sample_float(key, counter++) - 1);
    if (l.normalised) std::fill_n(parameters + l.gain, l.outputs, 1.0f);
    if (l.normalised && m_norm == Norm::batch) std::fill_n(parameters + l.variance, l.outputs, 1.0f);
  }
}

namespace {

bf16::Pair* words(float* p) { return reinterpret_cast<bf16::Pair*>(p); }
const bf16::Pair* words(const float* p) { return reinterpret_cast<const bf16::Pair*>(p); }

/// Gain and bias that a layer's normalisation comes to: y = gain * (V x) + bias.
struct Folded {
  std::vector<float> gain, bias;
  Folded(const DenseLayer& l, Norm norm, const float* p)
      : gain(static_cast<std::size_t>(l.outputs), 1.0f), bias(p + l.bias, p + l.bias + l.outputs) {
    if (!l.normalised) return;
    for (std::size_t o = 0; o < gain.size(); ++o) {
      gain[o] = p[l.gain + o];
      if (norm != Norm::batch) continue;
      gain[o] /= std::sqrt(p[l.variance + o] + kBatchNormEpsilon);
      bias[o] -= p[l.mean + o] * gain[o];
    }
  }
};

}  // namespace

std::size_t ResidualNet::scratch_count() const {
  const int most = std::max(m_width, padded_inputs(inputs()));
  return static_cast<std::size_t>((2 * m_width + most + round_up(outputs(), 16)) * kBlock);
}

void ResidualNet::pack(const float* parameters, float* packed) const {
  for (const DenseLayer& l : m_layers) {
    const Folded folded(l, m_norm, parameters);
    nn::pack(l.inputs, l.outputs, parameters + l.weight, folded.gain.data(), folded.bias.data(), packed + l.packed);
  }
}

void ResidualNet::pack_for_training(const float* parameters, float* packed, float* packed_back) const {
  for (const DenseLayer& l : m_layers) {
    const Folded folded(l, m_norm, parameters);
    const float *weight = parameters + l.weight, *gain = folded.gain.data(), *bias = folded.bias.data();
    if (m_products == Products::bf16) {
      bf16::pack(l.inputs, l.outputs, weight, gain, bias, words(packed + l.packed));
      bf16::pack_transposed(l.inputs, l.outputs, weight, gain, words(packed_back + l.packed_back));
    } else {
      nn::pack(l.inputs, l.outputs, weight, gain, bias, packed + l.packed);
      nn::pack_transposed(l.inputs, l.outputs, weight, gain, packed_back + l.packed_back);
    }
  }
}

void ResidualNet::pack_plain(const float* parameters, float* packed, float* packed_back) const {
  const std::vector<float> zero(static_cast<std::size_t>(m_width), 0.0f);
  for (const DenseLayer& l : m_layers) {
    nn::pack(l.inputs, l.outputs, parameters + l.weight, nullptr, l.normalised ? zero.data() : parameters + l.bias,
             packed + l.packed);
    pack_transposed(l.inputs, l.outputs, parameters + l.weight, nullptr, packed_back + l.packed_back);
  }
}

void ResidualNet::infer(const float* packed, const float* x, float* scratch, float* out) const {
  float *h = scratch, *a = scratch + m_width * kBlock;
  const auto layer = [&](Epilogue epilogue, std::size_t l, const float* from, float* to, const float* skip) {
    dense(epilogue, m_layers[l].inputs, m_layers[l].outputs, packed + m_layers[l].packed, from, to, skip);
  };
  if (m_layers.size() == 1) return layer(Epilogue::linear, 0, x, out, nullptr);
  layer(Epilogue::relu, 0, x, h, nullptr);
  for (std::size_t l = 1; l + 2 < m_layers.size(); l += 2) {
    layer(Epilogue::relu, l, h, a, nullptr);
    layer(Epilogue::add_relu, l + 1, a, h, h);
  }
  layer(Epilogue::linear, m_layers.size() - 1, h, out, nullptr);
}

void ResidualNet::forward(const float* packed, float* activations, float* out) const {
  if (m_products == Products::bf16) return forward_bf16(packed, activations, out);
  const float* x = activations;
  const std::size_t size = static_cast<std::size_t>(m_width * kBlock);
  float* h = activations + input_count();
  const auto layer = [&](Epilogue epilogue, std::size_t l, const float* from, float* to, const float* skip) {
    dense(epilogue, m_layers[l].inputs, m_layers[l].outputs, packed + m_layers[l].packed, from, to, skip);
  };
  if (m_layers.size() == 1) return layer(Epilogue::linear, 0, x, out, nullptr);
  layer(Epilogue::relu, 0, x, h, nullptr);
  for (std::size_t l = 1; l + 2 < m_layers.size(); l += 2, h += 2 * size) {
    layer(Epilogue::relu, l, h, h + size, nullptr);
    layer(Epilogue::add_relu, l + 1, h + size, h + 2 * size, h);
  }
  layer(Epilogue::linear, m_layers.size() - 1, h, out, nullptr);
}

void ResidualNet::backward(const float* packed_back, const float* activations, const float* d_out, float* gradients,
                           bool accumulate, float* d_x, bool accumulate_x, float* scratch) const {
  if (m_products == Products::bf16)
    return backward_bf16(packed_back, activations, d_out, gradients, accumulate, d_x, accumulate_x, scratch);
  const std::size_t size = static_cast<std::size_t>(m_width * kBlock);
  const std::size_t last = m_layers.size() - 1;
  float *g_h = scratch, *g_a = scratch + size, *transposed = scratch + 2 * size;
  const auto weights = [&](std::size_t l, const float* g, const float* from) {
    transpose(m_layers[l].inputs, from, transposed);
    const DenseLayer& layer = m_layers[l];
    dense_gradient(layer.inputs, layer.outputs, g, transposed, gradients + layer.weight, gradients + layer.bias,
                   accumulate);
  };
  const auto carry = [&](Epilogue epilogue, std::size_t l, const float* g, float* to, const float* skip,
                         const float* act) {
    const DenseLayer& layer = m_layers[l];
    dense(epilogue, layer.outputs, layer.inputs, packed_back + layer.packed_back, g, to, skip, act);
  };
  if (last == 0) return weights(0, d_out, activations);
  // h is the activation below layer l, g_h the gradient before the ReLU that made it.
  const float* h = activations + input_count() + (last - 1) * size;
  weights(last, d_out, h);
  carry(Epilogue::gate, last, d_out, g_h, nullptr, h);
  for (std::size_t l = last; l > 1; l -= 2, h -= 2 * size) {
    const float* a = h - size;
    const float* below = a - size;
    weights(l - 1, g_h, a);
    carry(Epilogue::gate, l - 1, g_h, g_a, nullptr, a);
    weights(l - 2, g_a, below);
    carry(Epilogue::add_gate, l - 2, g_a, g_h, g_h, below);
  }
  weights(0, g_h, activations);
  if (d_x) carry(accumulate_x ? Epilogue::add : Epilogue::linear, 0, g_h, d_x, d_x, nullptr);
}

// With bf16 a row takes half of the memory that its floats would.
void ResidualNet::forward_bf16(const float* packed, float* activations, float* out) const {
  using bf16::Pair;
  const std::size_t size = static_cast<std::size_t>(m_width * kBlock / 2), last = m_layers.size() - 1;
  const auto weights = [&](std::size_t l) { return words(packed + m_layers[l].packed); };
  const auto layer = [&](std::size_t l, const Pair* from, Pair* to, const Pair* skip) {
    bf16::dense(m_layers[l].inputs, m_layers[l].outputs, weights(l), from, to, skip);
  };
  Pair* const x = words(activations);
  bf16::narrow(inputs(), activations, x);
  Pair* h = x + input_count();
  layer(0, x, h, nullptr);
  for (std::size_t l = 1; l + 1 < last; l += 2, h += 2 * size) {
    layer(l, h, h + size, nullptr);
    layer(l + 1, h + size, h + 2 * size, h);
  }
  bf16::dense_out(m_width, outputs(), weights(last), h, out, false);
}

void ResidualNet::backward_bf16(const float* packed_back, const float* activations, const float* d_out,
                                float* gradients, bool accumulate, float* d_x, bool accumulate_x,
                                float* scratch) const {
  using bf16::Gradient, bf16::Pair;
  const std::size_t size = static_cast<std::size_t>(m_width * kBlock / 2), last = m_layers.size() - 1;
  const std::size_t out_size = static_cast<std::size_t>(bf16::pairs(outputs()) * kBlock);
  const auto take = [&scratch](std::size_t count) { return words(std::exchange(scratch, scratch + count)); };
  const Gradient g_h{take(size), take(size)}, g_a{take(size), take(size)}, g_out{take(out_size), take(out_size)};
  Pair* const transposed = words(scratch);
  const auto weights = [&](std::size_t l, Gradient g, const Pair* from) {
    const DenseLayer& layer = m_layers[l];
    bf16::transpose(layer.inputs, from, transposed);
    bf16::dense_gradient(layer.inputs, layer.outputs, g.rows, transposed, gradients + layer.weight,
                         gradients + layer.bias, accumulate);
  };
  const auto carry = [&](std::size_t l, Gradient g, const Pair* skip, const Pair* act, Gradient to) {
    const DenseLayer& layer = m_layers[l];
    bf16::dense_back(layer.outputs, layer.inputs, words(packed_back + layer.packed_back), g.pairs, skip, act, to);
  };
  const Pair* const x = words(activations);
  const Pair* h = x + input_count() + (last - 1) * size;
  bf16::narrow_gradient(outputs(), d_out, g_out);
  weights(last, g_out, h);
  carry(last, g_out, nullptr, h, g_h);
  for (std::size_t l = last; l > 1; l -= 2, h -= 2 * size) {
    const Pair* a = h - size;
    const Pair* below = a - size;
    weights(l - 1, g_h, a);
    carry(l - 1, g_h, nullptr, a, g_a);
    weights(l - 2, g_a, below);
    carry(l - 2, g_a, g_h.pairs, below, g_h);
  }
  weights(0, g_h, x);
  if (d_x)
    bf16::dense_out(m_width, inputs(), words(packed_back + m_layers[0].packed_back), g_h.pairs, d_x, accumulate_x);
}

void ResidualNet::unfold(const float* parameters, float* gradients) const {
  if (m_norm != Norm::actnorm) return;
  for (const DenseLayer& l : m_layers) {
    if (!l.normalised) continue;
    const std::size_t stride = static_cast<std::size_t>(padded_inputs(l.inputs));
    for (std::size_t o = 0; o < static_cast<std::size_t>(l.outputs); ++o) {
      const float* v = parameters + l.weight + o * stride;
      float* g = gradients + l.weight + o * stride;
      const float gain = parameters[l.gain + o];
      double sum = 0;
      for (std::size_t k = 0; k < stride; ++k) {
        sum += static_cast<double>(g[k]) * v[k];
        g[k] *= gain;
      }
      gradients[l.gain + o] = static_cast<float>(sum);
    }
  }
}

}  // namespace warpath::nn
