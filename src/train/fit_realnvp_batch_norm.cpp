#include "train/fit_realnvp_batch_norm.h"

#include <algorithm>
#include <cmath>

#include "nn/dense.h"
#include "warp/realnvp_kernels.h"

namespace warpath::realnvp {
namespace {

using nn::DenseLayer;
using nn::Epilogue;
using nn::kBlock;
using Floats = nn::AlignedVector<float>;

/// Weight of a batch in the running statistics, as PyTorch has it.
constexpr float kMomentum = 0.1f;

}  // namespace

BatchNormPass::BatchNormPass(const nn::ResidualNet& net, std::size_t blocks, std::size_t examples)
    : m_net(net),
      m_blocks(blocks),
      m_examples(examples),
      m_size(static_cast<std::size_t>(net.width()) * kBlock),
      m_packed(net.packed_count()),
      m_back(net.packed_back_count()),
      m_standard((net.layers().size() - 1) * blocks * m_size),
      m_active(m_standard.size()),
      m_g(blocks * m_size),
      m_g_skip(m_g.size()),
      m_g_next(m_g.size()),
      m_scratch(m_g.size()),
      m_inverse_deviation((net.layers().size() - 1) * static_cast<std::size_t>(net.width())),
      m_sums(blocks * static_cast<std::size_t>(net.width()) * 2) {}

std::size_t BatchNormPass::lanes(std::size_t block) const {
  return std::min<std::size_t>(kBlock, m_examples - std::min(m_examples, block * kBlock));
}

float* BatchNormPass::hidden(Floats& layers, std::size_t layer, std::size_t block) const {
  return layers.data() + (layer * m_blocks + block) * m_size;
}

void BatchNormPass::forward(const float* parameters, const float* x, float* out, std::size_t out_stride,
                            float* running) {
  m_net.pack_plain(parameters, m_packed.data(), m_back.data());
  const std::size_t width = static_cast<std::size_t>(m_net.width()), last = m_net.layers().size() - 1;
  const std::size_t inputs = static_cast<std::size_t>(m_net.inputs()) * kBlock;
  for (std::size_t l = 0; l < last; ++l) {
    const DenseLayer& layer = m_net.layers()[l];
    parallel(m_blocks, [&](std::size_t b) {
      float* v = hidden(m_standard, l, b);
      nn::dense(Epilogue::linear, layer.inputs, layer.outputs, m_packed.data() + layer.packed,
                l == 0 ? x + b * inputs : hidden(m_active, l - 1, b), v);
      for (std::size_t o = 0; o < width; ++o) {
        double sum = 0, squares = 0;
        for (std::size_t s = 0; s < lanes(b); ++s) {
          const double value = static_cast<double>(v[o * kBlock + s]);
          sum += value;
          squares += value * value;
        }
        m_sums[(b * width + o) * 2] = sum;
        m_sums[(b * width + o) * 2 + 1] = squares;
      }
    });
    std::vector<float> means(width);
    float* inverse_deviation = m_inverse_deviation.data() + l * width;
    for (std::size_t o = 0; o < width; ++o) {
      double sum = 0, squares = 0;
      for (std::size_t b = 0; b < m_blocks; ++b) {
        sum += m_sums[(b * width + o) * 2];
        squares += m_sums[(b * width + o) * 2 + 1];
      }
      const double n = static_cast<double>(m_examples), mean = sum / n;
      const double variance = std::max(squares / n - mean * mean, 0.0);
      means[o] = static_cast<float>(mean);
      inverse_deviation[o] = static_cast<float>(1 / std::sqrt(variance + static_cast<double>(nn::kBatchNormEpsilon)));
      if (!running) continue;
      running[layer.mean + o] += kMomentum * (means[o] - running[layer.mean + o]);
      running[layer.variance + o] += kMomentum * (static_cast<float>(variance) - running[layer.variance + o]);
    }
    parallel(m_blocks, [&](std::size_t b) {
      float* v = hidden(m_standard, l, b);
      float* active = hidden(m_active, l, b);
      const float* skip = l > 0 && l % 2 == 0 ? hidden(m_active, l - 2, b) : nullptr;
      for (std::size_t o = 0; o < width; ++o) {
        const float gain = parameters[layer.gain + o], bias = parameters[layer.bias + o];
        for (std::size_t i = o * kBlock; i < (o + 1) * kBlock; ++i) {
          v[i] = (v[i] - means[o]) * inverse_deviation[o];
          active[i] = std::max(gain * v[i] + bias + (skip ? skip[i] : 0.0f), 0.0f);
        }
      }
    });
  }
  const DenseLayer& layer = m_net.layers()[last];
  parallel(m_blocks, [&](std::size_t b) {
    nn::dense(Epilogue::linear, layer.inputs, layer.outputs, m_packed.data() + layer.packed,
              hidden(m_active, last - 1, b), out + b * out_stride);
  });
}

void BatchNormPass::backward(const float* parameters, const float* x, const float* d_out, std::size_t out_stride,
                             float* gradients, std::size_t slots, std::size_t slot_stride, float* d_x,
                             bool accumulate_x) {
  const std::size_t width = static_cast<std::size_t>(m_net.width()), last = m_net.layers().size() - 1;
  const std::size_t inputs = static_cast<std::size_t>(m_net.inputs()) * kBlock;
  const std::size_t panel =
      static_cast<std::size_t>(nn::padded_inputs(std::max(m_net.inputs(), m_net.width()))) * kBlock;
  Floats transposed(slots * panel), no_bias(slots * width);
  // Gradient of a layer's weights, each slot over its own blocks; then `then(block)`.
  const auto weights = [&](std::size_t l, const auto& gradient_of, const auto& then) {
    const DenseLayer& layer = m_net.layers()[l];
    parallel(slots, [&](std::size_t slot) {
      float* to = gradients + slot * slot_stride;
      float* t = transposed.data() + slot * panel;
      const std::size_t first = slot * m_blocks / slots, end = (slot + 1) * m_blocks / slots;
      for (std::size_t b = first; b < end; ++b) {
        const float* g = gradient_of(b);
        nn::transpose(layer.inputs, l == 0 ? x + b * inputs : hidden(m_active, l - 1, b), t);
        nn::dense_gradient(layer.inputs, layer.outputs, g, t, to + layer.weight,
                           layer.normalised ? no_bias.data() + slot * width : to + layer.bias, b > first);
        then(b, g);
      }
    });
  };
  const auto block = [&](Floats& rows, std::size_t b) { return rows.data() + b * m_size; };

  weights(
      last, [&](std::size_t b) { return d_out + b * out_stride; },
      [&](std::size_t b, const float* g) {
        const DenseLayer& layer = m_net.layers()[last];
        nn::dense(Epilogue::gate, layer.outputs, layer.inputs, m_back.data() + layer.packed_back, g, block(m_g, b),
                  nullptr, hidden(m_active, last - 1, b));
      });
  for (std::size_t l = last; l-- > 0;) {
    const DenseLayer& layer = m_net.layers()[l];
    parallel(m_blocks, [&](std::size_t b) {
      const float *g = block(m_g, b), *standard = hidden(m_standard, l, b);
      for (std::size_t o = 0; o < width; ++o) {
        double sum = 0, product = 0;
        for (std::size_t i = o * kBlock; i < o * kBlock + lanes(b); ++i) {
          sum += static_cast<double>(g[i]);
          product += static_cast<double>(g[i] * standard[i]);
        }
        m_sums[(b * width + o) * 2] = sum;
        m_sums[(b * width + o) * 2 + 1] = product;
      }
    });
    for (std::size_t o = 0; o < width; ++o) {
      double sum = 0, product = 0;
      for (std::size_t b = 0; b < m_blocks; ++b) {
        sum += m_sums[(b * width + o) * 2];
        product += m_sums[(b * width + o) * 2 + 1];
      }
      gradients[layer.bias + o] = static_cast<float>(sum);
      gradients[layer.gain + o] = static_cast<float>(product);
    }
    const float share = 1 / static_cast<float>(m_examples);
    const auto through_norm = [&](std::size_t b) -> const float* {
      const float *g = block(m_g, b), *standard = hidden(m_standard, l, b);
      float* d = block(m_scratch, b);
      for (std::size_t o = 0; o < width; ++o) {
        const float scale = parameters[layer.gain + o] * m_inverse_deviation[l * width + o];
        const float mean = gradients[layer.bias + o] * share, slope = gradients[layer.gain + o] * share;
        for (std::size_t s = 0; s < kBlock; ++s) {
          const std::size_t i = o * kBlock + s;
          d[i] = s < lanes(b) ? scale * (g[i] - mean - standard[i] * slope) : 0.0f;
        }
      }
      return d;
    };
    weights(l, through_norm, [&](std::size_t b, const float* g) {
      const float* back = m_back.data() + layer.packed_back;
      if (l == 0) {
        if (d_x)
          nn::dense(accumulate_x ? Epilogue::add : Epilogue::linear, layer.outputs, layer.inputs, back, g,
                    d_x + b * inputs, d_x + b * inputs);
      } else if (l % 2 == 0) {  // closes a block: what comes in goes to the block's start as well
        nn::dense(Epilogue::gate, layer.outputs, layer.inputs, back, g, block(m_g_next, b), nullptr,
                  hidden(m_active, l - 1, b));
        std::copy_n(block(m_g, b), m_size, block(m_g_skip, b));
      } else {
        nn::dense(Epilogue::add_gate, layer.outputs, layer.inputs, back, g, block(m_g_next, b), block(m_g_skip, b),
                  hidden(m_active, l - 1, b));
      }
    });
    std::swap(m_g, m_g_next);
  }
}

double batch_norm_step(const Flow& flow, const ExampleBlocks& batch, const FlowObjective& objective, float* parameters,
                       float* gradients, std::size_t slots) {
  const std::size_t dims = batch.dims, blocks = batch.count, couplings = flow.couplings().size();
  const std::size_t state = dims * kBlock;
  const auto row = [](float* rows, std::size_t r) { return rows + r * kBlock; };
  // v before each coupling, and at the end those of z, for every block.
  Floats v((couplings + 1) * blocks * state), d_v(blocks * state), weight(blocks * kBlock);
  nn::AlignedVector<double> log_q(blocks * kBlock, 0.0);
  const auto at = [&](std::size_t c, std::size_t b) { return v.data() + (c * blocks + b) * state; };
  std::vector<BatchNormPass> passes;
  Floats x, d_x, heads, d_heads;
  std::size_t inputs = 0, head_rows = 0;

  // Heads of all blocks, from the v above the coupling.
  const auto condition = [&](std::size_t c, float* running) {
    const Coupling& coupling = flow.couplings()[c];
    inputs = static_cast<std::size_t>(coupling.nets[0].inputs()) * kBlock;
    head_rows = 2 * coupling.moved.size() * kBlock;
    x.resize(blocks * inputs);
    heads.resize(blocks * head_rows);
    parallel(blocks, [&](std::size_t b) { flow.encode_kept(coupling, at(c + 1, b), x.data() + b * inputs); });
    passes.clear();
    for (std::size_t n = 0; n < coupling.nets.size(); ++n) {
      const std::size_t offset = coupling.parameters[n];
      passes.emplace_back(coupling.nets[n], blocks, batch.examples);
      passes.back().forward(parameters + offset, x.data(), row(heads.data(), n * coupling.moved.size()), head_rows,
                            running ? running + offset : nullptr);
    }
  };

  parallel(blocks, [&](std::size_t b) {
    logit(flow.dims(), batch.block_y(b), at(couplings, b));
    add_log_logistic(flow.dims(), at(couplings, b), true, log_q.data() + b * kBlock);
  });
  for (std::size_t c = couplings; c-- > 0;) {
    const Coupling& coupling = flow.couplings()[c];
    condition(c, parameters);
    parallel(blocks, [&](std::size_t b) {
      float* h = heads.data() + b * head_rows;
      std::copy_n(at(c + 1, b), state, at(c, b));
      uncouple(coupling.moved, &parameters[coupling.scales], h, at(c, b), log_q.data() + b * kBlock);
    });
  }
  std::vector<double> loss(blocks);
  parallel(blocks, [&](std::size_t b) {
    float* w = weight.data() + b * kBlock;
    add_log_logistic(flow.dims(), at(0, b), false, log_q.data() + b * kBlock);
    loss[b] = block_loss(objective, log_q.data() + b * kBlock, batch.block_weight(b), batch.block_target(b), w);
    log_logistic_gradient(flow.dims(), w, at(0, b), d_v.data() + b * state);
  });

  for (std::size_t c = 0; c < couplings; ++c) {
    const Coupling& coupling = flow.couplings()[c];
    const std::size_t moved = coupling.moved.size();
    condition(c, nullptr);
    d_heads.resize(heads.size());
    d_x.resize(x.size());
    std::vector<float> d_scale(blocks * moved);
    parallel(blocks, [&](std::size_t b) {
      float *h = heads.data() + b * head_rows, *d_h = d_heads.data() + b * head_rows;
      for (std::size_t k = 0; k < moved; ++k) {
        const std::size_t i = static_cast<std::size_t>(coupling.moved[k]);
        d_scale[b * moved + k] =
            uncouple_backward(parameters[coupling.scales + k], row(h, k), row(h, moved + k), weight.data() + b * kBlock,
                              row(at(c + 1, b), i), row(d_v.data() + b * state, i), row(d_h, k), row(d_h, moved + k));
      }
    });
    for (std::size_t k = 0; k < moved; ++k) {
      float& sum = gradients[coupling.scales + k] = 0;
      for (std::size_t b = 0; b < blocks; ++b) sum += d_scale[b * moved + k];
    }
    for (std::size_t n = 0; n < coupling.nets.size(); ++n)
      passes[n].backward(parameters + coupling.parameters[n], x.data(), row(d_heads.data(), n * moved), head_rows,
                         gradients + coupling.parameters[n], slots, flow.parameter_count(), d_x.data(), n > 0);
    parallel(blocks, [&](std::size_t b) {
      flow.encode_kept_backward(coupling, at(c + 1, b), d_x.data() + b * inputs, d_v.data() + b * state);
    });
  }
  double sum = 0;
  for (const double l : loss) sum += l;
  return sum;
}

FlowOptimiser::Pass batch_norm_pass(const Flow& flow) {
  return [&flow](const ExampleBlocks& batch, const FlowObjective& objective, float* parameters, float* gradients,
                 std::size_t slots) { return batch_norm_step(flow, batch, objective, parameters, gradients, slots); };
}

}  // namespace warpath::realnvp
