#include "train/batch_norm_net.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "nn/dense.h"

namespace warpath::realnvp {
namespace {

using nn::DenseLayer;
using nn::Epilogue;
using nn::kBlock;
using Floats = nn::AlignedVector<float>;

/// Weight of a batch in the running statistics, as PyTorch has it.
constexpr float kMomentum = 0.1f;

}  // namespace

BatchNormNet::BatchNormNet(const nn::ResidualNet& net, std::size_t blocks, std::size_t examples)
    : m_net(net),
      m_blocks(blocks),
      m_examples(examples),
      m_width(static_cast<std::size_t>(net.width())),
      m_size(m_width * kBlock),
      m_packed(net.packed_count()),
      m_back(net.packed_back_count()),
      m_standard((net.layers().size() - 1) * blocks * m_size),
      m_active(m_standard.size()),
      m_g(blocks * m_size),
      m_g_skip(m_g.size()),
      m_g_next(m_g.size()),
      m_scratch(m_g.size()),
      m_mean(m_width),
      m_inverse_deviation((net.layers().size() - 1) * m_width),
      m_sums(blocks * m_width * 2) {}

std::size_t BatchNormNet::lanes(std::size_t block) const {
  return std::min<std::size_t>(kBlock, m_examples - std::min(m_examples, block * kBlock));
}

float* BatchNormNet::hidden(Floats& layers, std::size_t layer, std::size_t block) const {
  return layers.data() + (layer * m_blocks + block) * m_size;
}

const float* BatchNormNet::input(std::size_t layer, const float* x, std::size_t block) {
  if (layer > 0) return hidden(m_active, layer - 1, block);
  return x + block * static_cast<std::size_t>(m_net.inputs()) * kBlock;
}

void BatchNormNet::gather_statistics(std::size_t l, float* running) {
  const DenseLayer& layer = m_net.layers()[l];
  for (std::size_t o = 0; o < m_width; ++o) {
    double sum = 0, squares = 0;
    for (std::size_t b = 0; b < m_blocks; ++b) {
      sum += m_sums[(b * m_width + o) * 2];
      squares += m_sums[(b * m_width + o) * 2 + 1];
    }
    const double n = static_cast<double>(m_examples), mean = sum / n;
    const double variance = std::max(squares / n - mean * mean, 0.0);
    m_mean[o] = static_cast<float>(mean);
    m_inverse_deviation[l * m_width + o] =
        static_cast<float>(1 / std::sqrt(variance + static_cast<double>(nn::kBatchNormEpsilon)));
    if (!running) continue;
    running[layer.mean + o] += kMomentum * (m_mean[o] - running[layer.mean + o]);
    running[layer.variance + o] += kMomentum * (static_cast<float>(variance) - running[layer.variance + o]);
  }
}

void BatchNormNet::normalise(std::size_t l, const float* parameters) {
  const DenseLayer& layer = m_net.layers()[l];
  parallel(m_blocks, [&](std::size_t b) {
    float* v = hidden(m_standard, l, b);
    float* active = hidden(m_active, l, b);
    const float* skip = l > 0 && l % 2 == 0 ? hidden(m_active, l - 2, b) : nullptr;
    for (std::size_t o = 0; o < m_width; ++o) {
      const float gain = parameters[layer.gain + o], bias = parameters[layer.bias + o];
      const float mean = m_mean[o], inverse_deviation = m_inverse_deviation[l * m_width + o];
      for (std::size_t i = o * kBlock; i < (o + 1) * kBlock; ++i) {
        v[i] = (v[i] - mean) * inverse_deviation;
        active[i] = std::max(gain * v[i] + bias + (skip ? skip[i] : 0.0f), 0.0f);
      }
    }
  });
}

void BatchNormNet::forward(const float* parameters, const float* x, float* out, std::size_t out_stride,
                           float* running) {
  m_net.pack_plain(parameters, m_packed.data(), m_back.data());
  const std::size_t last = m_net.layers().size() - 1;
  for (std::size_t l = 0; l < last; ++l) {
    const DenseLayer& layer = m_net.layers()[l];
    parallel(m_blocks, [&](std::size_t b) {
      float* v = hidden(m_standard, l, b);
      nn::dense(Epilogue::linear, layer.inputs, layer.outputs, m_packed.data() + layer.packed, input(l, x, b), v);
      for (std::size_t o = 0; o < m_width; ++o) {
        double sum = 0, squares = 0;
        for (std::size_t s = 0; s < lanes(b); ++s) {
          const double value = static_cast<double>(v[o * kBlock + s]);
          sum += value;
          squares += value * value;
        }
        m_sums[(b * m_width + o) * 2] = sum;
        m_sums[(b * m_width + o) * 2 + 1] = squares;
      }
    });
    gather_statistics(l, running);
    normalise(l, parameters);
  }
  const DenseLayer& layer = m_net.layers()[last];
  parallel(m_blocks, [&](std::size_t b) {
    nn::dense(Epilogue::linear, layer.inputs, layer.outputs, m_packed.data() + layer.packed, input(last, x, b),
              out + b * out_stride);
  });
}

template <class GradientOf, class Then>
void BatchNormNet::weight_gradients(std::size_t l, const float* x, const GradientSlots& to,
                                    const GradientOf& gradient_of, const Then& then) {
  const DenseLayer& layer = m_net.layers()[l];
  const std::size_t panel = m_transposed.size() / to.slots;
  parallel(to.slots, [&](std::size_t slot) {
    float* gradients = to.gradients + slot * to.stride;
    float* t = m_transposed.data() + slot * panel;
    const std::size_t first = slot * m_blocks / to.slots, end = (slot + 1) * m_blocks / to.slots;
    for (std::size_t b = first; b < end; ++b) {
      const float* g = gradient_of(b);
      nn::transpose(layer.inputs, input(l, x, b), t);
      nn::dense_gradient(layer.inputs, layer.outputs, g, t, gradients + layer.weight,
                         layer.normalised ? m_no_bias.data() + slot * m_width : gradients + layer.bias, b > first);
      then(b, g);
    }
  });
}

void BatchNormNet::gain_gradients(std::size_t l, float* gradients) {
  const DenseLayer& layer = m_net.layers()[l];
  parallel(m_blocks, [&](std::size_t b) {
    const float *g = rows(m_g, b), *standard = hidden(m_standard, l, b);
    for (std::size_t o = 0; o < m_width; ++o) {
      double sum = 0, product = 0;
      for (std::size_t i = o * kBlock; i < o * kBlock + lanes(b); ++i) {
        sum += static_cast<double>(g[i]);
        product += static_cast<double>(g[i] * standard[i]);
      }
      m_sums[(b * m_width + o) * 2] = sum;
      m_sums[(b * m_width + o) * 2 + 1] = product;
    }
  });
  for (std::size_t o = 0; o < m_width; ++o) {
    double sum = 0, product = 0;
    for (std::size_t b = 0; b < m_blocks; ++b) {
      sum += m_sums[(b * m_width + o) * 2];
      product += m_sums[(b * m_width + o) * 2 + 1];
    }
    gradients[layer.bias + o] = static_cast<float>(sum);
    gradients[layer.gain + o] = static_cast<float>(product);
  }
}

const float* BatchNormNet::through_normalisation(std::size_t l, std::size_t b, const float* parameters,
                                                 const float* gradients) {
  const DenseLayer& layer = m_net.layers()[l];
  const float share = 1 / static_cast<float>(m_examples);
  const float *g = rows(m_g, b), *standard = hidden(m_standard, l, b);
  float* d = rows(m_scratch, b);
  for (std::size_t o = 0; o < m_width; ++o) {
    const float scale = parameters[layer.gain + o] * m_inverse_deviation[l * m_width + o];
    const float mean = gradients[layer.bias + o] * share, slope = gradients[layer.gain + o] * share;
    for (std::size_t s = 0; s < kBlock; ++s) {
      const std::size_t i = o * kBlock + s;
      d[i] = s < lanes(b) ? scale * (g[i] - mean - standard[i] * slope) : 0.0f;
    }
  }
  return d;
}

void BatchNormNet::through_weights(std::size_t l, std::size_t b, const float* g, float* d_x, bool accumulate_x) {
  const DenseLayer& layer = m_net.layers()[l];
  const float* back = m_back.data() + layer.packed_back;
  if (l == 0) {
    if (!d_x) return;
    float* to = d_x + b * static_cast<std::size_t>(m_net.inputs()) * kBlock;
    nn::dense(accumulate_x ? Epilogue::add : Epilogue::linear, layer.outputs, layer.inputs, back, g, to, to);
  } else if (l == m_net.layers().size() - 1) {
    nn::dense(Epilogue::gate, layer.outputs, layer.inputs, back, g, rows(m_g_next, b), nullptr,
              hidden(m_active, l - 1, b));
  } else if (l % 2 == 0) {  // closes a block: what comes in goes to the block's start as well
    nn::dense(Epilogue::gate, layer.outputs, layer.inputs, back, g, rows(m_g_next, b), nullptr,
              hidden(m_active, l - 1, b));
    std::copy_n(rows(m_g, b), m_size, rows(m_g_skip, b));
  } else {
    nn::dense(Epilogue::add_gate, layer.outputs, layer.inputs, back, g, rows(m_g_next, b), rows(m_g_skip, b),
              hidden(m_active, l - 1, b));
  }
}

void BatchNormNet::backward(const float* parameters, const float* x, const float* d_out, std::size_t out_stride,
                            const GradientSlots& to, float* d_x, bool accumulate_x) {
  const std::size_t last = m_net.layers().size() - 1;
  m_transposed.resize(to.slots * static_cast<std::size_t>(nn::padded_inputs(std::max(m_net.inputs(), m_net.width()))) *
                      kBlock);
  m_no_bias.resize(to.slots * m_width);
  const auto through_layer = [&](std::size_t l, const auto& gradient_of) {
    weight_gradients(l, x, to, gradient_of,
                     [&](std::size_t b, const float* g) { through_weights(l, b, g, d_x, accumulate_x); });
    std::swap(m_g, m_g_next);
  };
  through_layer(last, [&](std::size_t b) { return d_out + b * out_stride; });
  for (std::size_t l = last; l-- > 0;) {
    gain_gradients(l, to.gradients);
    through_layer(l, [&](std::size_t b) { return through_normalisation(l, b, parameters, to.gradients); });
  }
}

}  // namespace warpath::realnvp
