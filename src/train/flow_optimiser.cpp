#include "train/flow_optimiser.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace warpath {
namespace {

using nn::kBlock;

/// A batch's blocks are dealt out to this many gradients, which are then added in their order: so the sum does not
/// depend on threads. More would cost memory traffic, fewer would leave threads idle.
constexpr std::size_t kSlots = 8;

/// E[g / q] starts near E[g], because q is 1 at the start.
FlowObjective initial_objective(const FlowTraining& settings, const ExampleBlocks& batch) {
  double scale = 0;
  for (std::size_t i = 0; i < batch.examples; ++i)
    scale += static_cast<double>(batch.weight[i]) * static_cast<double>(batch.target[i]);
  return {settings.loss, settings.expected_uniform_share, std::max(scale, 1e-30)};
}

}  // namespace

void ExampleBlocks::resize(std::size_t examples_, std::size_t dims_, std::size_t context_rows_) {
  examples = examples_;
  count = (examples + kBlock - 1) / kBlock;
  dims = dims_;
  context_rows = context_rows_;
  context.assign(count * context_rows * kBlock, 0.0f);
  y.assign(count * dims * kBlock, 0.5);
  weight.assign(count * kBlock, 0.0f);
  target = weight;
}

void ExampleBlocks::set(std::size_t i, std::span<const float> example, float w, float g) {
  const std::size_t block = i / kBlock, lane = i % kBlock;
  for (std::size_t d = 0; d < dims; ++d) y[(block * dims + d) * kBlock + lane] = static_cast<double>(example[d]);
  weight[i] = w;
  target[i] = g;
}

FlowOptimiser::FlowOptimiser(const CouplingFlow& flow, nn::AlignedVector<float> parameters,
                             const FlowTraining& settings, Pass pass)
    : m_flow(flow),
      m_settings(settings),
      m_pass(std::move(pass)),
      m_parameters(std::move(parameters)),
      m_average(m_parameters),
      m_gradients(kSlots * m_parameters.size(), 0.0f),
      m_m(m_parameters.size(), 0.0f),
      m_v(m_m),
      m_scratch(kSlots) {
  if (m_pass) return;  // it has numbers of its own for each step
  for (auto& scratch : m_scratch) scratch.resize(flow.training_scratch_count());
  m_flow.pack(m_parameters.data(), m_packed, true);
}

double FlowOptimiser::step(const ExampleBlocks& batch, double rate) {
  const std::size_t slots = std::min(kSlots, batch.count);
  if (m_step == 0) m_objective = initial_objective(m_settings, batch);
  const double loss =
      m_pass ? m_pass(batch, m_objective, m_parameters.data(), m_gradients.data(), slots) : fused_pass(batch, slots);
  ++m_step;
  const nn::Adam adam{.rate = static_cast<float>(rate)};
  parallel(m_flow.coupling_count(), [&](std::size_t c) { update(c, slots, adam); });
  if (m_objective.loss == FlowTraining::Loss::likelihood) return loss;
  m_objective.scale += 0.05 * (loss - m_objective.scale);
  return std::log(loss);
}

double FlowOptimiser::fused_pass(const ExampleBlocks& batch, std::size_t slots) {
  std::array<double, kSlots> loss{};
  parallel(slots, [&](std::size_t slot) {
    const std::size_t first = slot * batch.count / slots, end = (slot + 1) * batch.count / slots;
    for (std::size_t b = first; b < end; ++b)
      loss[slot] += m_flow.train_block(
          m_packed, batch.block_y(b), batch.block_context(b), batch.block_weight(b), batch.block_target(b), m_objective,
          m_gradients.data() + slot * m_parameters.size(), b > first, m_scratch[slot].data());
  });
  return std::accumulate(loss.begin(), loss.end(), 0.0);
}

// One coupling's share of everything that follows the gradient, while its numbers are in the cache.
void FlowOptimiser::update(std::size_t c, std::size_t slots, const nn::Adam& adam) {
  const std::size_t from = m_flow.first_parameter(c), count = m_flow.first_parameter(c + 1) - from;
  nn::add_slots(static_cast<int>(slots), m_parameters.size(), count, m_gradients.data() + from);
  m_flow.unfold(c, m_parameters.data(), m_gradients.data());
  nn::adam_step(adam, m_step, count, m_gradients.data() + from, m_parameters.data() + from, m_m.data() + from,
                m_v.data() + from);
  // Young averages forget faster, so that the start has no part in them.
  const double decay = std::min(m_settings.average, m_step / (m_step + 10.0));
  nn::move_average(static_cast<float>(1 - decay), count, m_parameters.data() + from, m_average.data() + from);
  if (!m_pass) m_flow.pack_coupling(c, m_parameters.data(), m_packed);
}

}  // namespace warpath
