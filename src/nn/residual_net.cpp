#include "nn/residual_net.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/rng.h"
#include "nn/dense.h"
#include "warpath/error.h"

namespace warpath::nn {

ResidualNet::ResidualNet(int inputs, int width, int blocks, int outputs, Norm norm) : m_width(width), m_norm(norm) {
  if (width < 16 || width % 16 != 0) throw ConfigError(fmt::format("width {}: must be a multiple of 16", width));
  if (blocks < 0) throw ConfigError(fmt::format("blocks {}: must not be negative", blocks));
  // Constants need no more than a bias.
  const int hidden = inputs == 0 && norm == Norm::none ? 0 : 1 + 2 * blocks;
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

void ResidualNet::pack(const float* parameters, float* packed) const {
  for (const DenseLayer& l : m_layers) {
    const Folded folded(l, m_norm, parameters);
    nn::pack(l.inputs, l.outputs, parameters + l.weight, folded.gain.data(), folded.bias.data(), packed + l.packed);
  }
}

void ResidualNet::pack_back(const float* parameters, float* packed_back) const {
  for (const DenseLayer& l : m_layers) {
    const Folded folded(l, m_norm, parameters);
    pack_transposed(l.inputs, l.outputs, parameters + l.weight, folded.gain.data(), packed_back + l.packed_back);
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

void ResidualNet::forward(const float* packed, const float* x, float* activations, float* out) const {
  const std::size_t size = static_cast<std::size_t>(m_width * kBlock);
  float* h = activations;
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

void ResidualNet::backward(const float* packed_back, const float* xt, const float* activations, const float* d_out,
                           float* gradients, bool accumulate, float* d_x, bool accumulate_x, float* scratch) const {
  const std::size_t size = static_cast<std::size_t>(m_width * kBlock);
  const std::size_t last = m_layers.size() - 1;
  float *g_h = scratch, *g_a = scratch + size, *transposed = scratch + 2 * size;
  const auto weights = [&](std::size_t l, const float* g, const float* inputs_t) {
    const DenseLayer& layer = m_layers[l];
    dense_gradient(layer.inputs, layer.outputs, g, inputs_t, gradients + layer.weight, gradients + layer.bias,
                   accumulate);
  };
  const auto inputs = [&](Epilogue epilogue, std::size_t l, const float* g, float* to, const float* skip,
                          const float* act) {
    const DenseLayer& layer = m_layers[l];
    dense(epilogue, layer.outputs, layer.inputs, packed_back + layer.packed_back, g, to, skip, act);
  };
  if (last == 0) return weights(0, d_out, xt);
  // h is the activation below layer l, g_h the gradient before the ReLU that made it.
  const float* h = activations + (last - 1) * size;
  transpose(m_width, h, transposed);
  weights(last, d_out, transposed);
  inputs(Epilogue::gate, last, d_out, g_h, nullptr, h);
  for (std::size_t l = last; l > 1; l -= 2, h -= 2 * size) {
    const float* a = h - size;
    const float* below = a - size;
    transpose(m_width, a, transposed);
    weights(l - 1, g_h, transposed);
    inputs(Epilogue::gate, l - 1, g_h, g_a, nullptr, a);
    transpose(m_width, below, transposed);
    weights(l - 2, g_a, transposed);
    inputs(Epilogue::add_gate, l - 2, g_a, g_h, g_h, below);
  }
  weights(0, g_h, xt);
  if (d_x) inputs(accumulate_x ? Epilogue::add : Epilogue::linear, 0, g_h, d_x, d_x, nullptr);
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
