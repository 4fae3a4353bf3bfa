#include "train/fit_realnvp_batch_norm.h"

#include <algorithm>
#include <vector>

#include "train/batch_norm_net.h"
#include "warp/realnvp_kernels.h"

namespace warpath::realnvp {
namespace {

using nn::kBlock;
using Floats = nn::AlignedVector<float>;

float* row(float* rows, std::size_t r) { return rows + r * kBlock; }

/// A batch on its way through a flow and back, a coupling at a time.
class BatchNormStep {
 public:
  /// Running statistics in `parameters` are moved.
  BatchNormStep(const Flow& flow, const ExampleBlocks& batch, float* parameters)
      : m_flow(flow),
        m_batch(batch),
        m_parameters(parameters),
        m_state(batch.dims * kBlock),
        m_v((flow.couplings().size() + 1) * batch.count * m_state),
        m_d_v(batch.count * m_state),
        m_weight(batch.count * kBlock),
        m_log_q(batch.count * kBlock, 0.0) {}

  /// From y to z through all couplings.
  void invert();
  /// After that: the loss, and its derivatives with respect to z.
  double loss(const FlowObjective& objective);
  /// After that, for one coupling after the other in their order: gradients of its parameters, and derivatives with
  /// respect to what is above it.
  void backward(std::size_t coupling, const GradientSlots& to);

 private:
  /// v of a block before each coupling, and at the end those of y.
  float* at(std::size_t coupling, std::size_t block) {
    return m_v.data() + (coupling * m_batch.count + block) * m_state;
  }
  /// The networks of a coupling over all blocks, from the v above it.
  void condition(std::size_t c, float* running);

  const Flow& m_flow;
  const ExampleBlocks& m_batch;
  float* m_parameters;
  std::size_t m_state;  // numbers of a block's v
  Floats m_v, m_d_v, m_weight;
  nn::AlignedVector<double> m_log_q;
  // Of the coupling that was conditioned last.
  std::vector<BatchNormNet> m_nets;
  Floats m_x, m_d_x, m_heads, m_d_heads;
  std::size_t m_inputs = 0, m_head_rows = 0;  // numbers of a block's x and heads
};

void BatchNormStep::condition(std::size_t c, float* running) {
  const Coupling& coupling = m_flow.couplings()[c];
  const std::size_t blocks = m_batch.count;
  m_inputs = static_cast<std::size_t>(coupling.nets[0].inputs()) * kBlock;
  m_head_rows = 2 * coupling.moved.size() * kBlock;
  m_x.resize(blocks * m_inputs);
  m_heads.resize(blocks * m_head_rows);
  parallel(blocks, [&](std::size_t b) { m_flow.encode_kept(coupling, at(c + 1, b), m_x.data() + b * m_inputs); });
  m_nets.clear();
  for (std::size_t n = 0; n < coupling.nets.size(); ++n) {
    const std::size_t offset = coupling.parameters[n];
    m_nets.emplace_back(coupling.nets[n], blocks, m_batch.examples);
    m_nets.back().forward(m_parameters + offset, m_x.data(), row(m_heads.data(), n * coupling.moved.size()),
                          m_head_rows, running ? running + offset : nullptr);
  }
}

void BatchNormStep::invert() {
  const std::size_t couplings = m_flow.couplings().size();
  parallel(m_batch.count, [&](std::size_t b) {
    logit(m_flow.dims(), m_batch.block_y(b), at(couplings, b));
    add_log_logistic(m_flow.dims(), at(couplings, b), true, m_log_q.data() + b * kBlock);
  });
  for (std::size_t c = couplings; c-- > 0;) {
    const Coupling& coupling = m_flow.couplings()[c];
    condition(c, m_parameters);
    parallel(m_batch.count, [&](std::size_t b) {
      std::copy_n(at(c + 1, b), m_state, at(c, b));
      uncouple(coupling.moved, &m_parameters[coupling.scales], m_heads.data() + b * m_head_rows, at(c, b),
               m_log_q.data() + b * kBlock);
    });
  }
}

double BatchNormStep::loss(const FlowObjective& objective) {
  std::vector<double> losses(m_batch.count);
  parallel(m_batch.count, [&](std::size_t b) {
    float* w = m_weight.data() + b * kBlock;
    double* log_q = m_log_q.data() + b * kBlock;
    add_log_logistic(m_flow.dims(), at(0, b), false, log_q);
    losses[b] = block_loss(objective, log_q, m_batch.block_weight(b), m_batch.block_target(b), w);
    log_logistic_gradient(m_flow.dims(), w, at(0, b), m_d_v.data() + b * m_state);
  });
  double sum = 0;
  for (const double loss : losses) sum += loss;
  return sum;
}

void BatchNormStep::backward(std::size_t c, const GradientSlots& to) {
  const Coupling& coupling = m_flow.couplings()[c];
  const std::size_t moved = coupling.moved.size(), blocks = m_batch.count;
  condition(c, nullptr);
  m_d_heads.resize(m_heads.size());
  m_d_x.resize(m_x.size());
  std::vector<float> d_scale(blocks * moved);
  parallel(blocks, [&](std::size_t b) {
    float *h = m_heads.data() + b * m_head_rows, *d_h = m_d_heads.data() + b * m_head_rows;
    for (std::size_t k = 0; k < moved; ++k) {
      const std::size_t i = static_cast<std::size_t>(coupling.moved[k]);
      d_scale[b * moved + k] = uncouple_backward(m_parameters[coupling.scales + k], row(h, k), row(h, moved + k),
                                                 m_weight.data() + b * kBlock, row(at(c + 1, b), i),
                                                 row(m_d_v.data() + b * m_state, i), row(d_h, k), row(d_h, moved + k));
    }
  });
  for (std::size_t k = 0; k < moved; ++k) {
    float& sum = to.gradients[coupling.scales + k] = 0;
    for (std::size_t b = 0; b < blocks; ++b) sum += d_scale[b * moved + k];
  }
  for (std::size_t n = 0; n < coupling.nets.size(); ++n)
    m_nets[n].backward(m_parameters + coupling.parameters[n], m_x.data(), row(m_d_heads.data(), n * moved), m_head_rows,
                       to.from(coupling.parameters[n]), m_d_x.data(), n > 0);
  parallel(blocks, [&](std::size_t b) {
    m_flow.encode_kept_backward(coupling, at(c + 1, b), m_d_x.data() + b * m_inputs, m_d_v.data() + b * m_state);
  });
}

}  // namespace

double batch_norm_step(const Flow& flow, const ExampleBlocks& batch, const FlowObjective& objective, float* parameters,
                       float* gradients, std::size_t slots) {
  BatchNormStep step(flow, batch, parameters);
  step.invert();
  const double loss = step.loss(objective);
  for (std::size_t c = 0; c < flow.couplings().size(); ++c)
    step.backward(c, {gradients, slots, flow.parameter_count()});
  return loss;
}

FlowOptimiser::Pass batch_norm_pass(const Flow& flow) {
  return [&flow](const ExampleBlocks& batch, const FlowObjective& objective, float* parameters, float* gradients,
                 std::size_t slots) { return batch_norm_step(flow, batch, objective, parameters, gradients, slots); };
}

}  // namespace warpath::realnvp
