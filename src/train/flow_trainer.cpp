#include "train/flow_trainer.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/interrupt.h"
#include "core/rng.h"
#include "train/jitter.h"
#include "warpath/error.h"

namespace warpath {

using nn::kBlock;
using Floats = nn::AlignedVector<float>;
using Doubles = nn::AlignedVector<double>;

namespace {

/// Examples held out at most: more would tell the loss no better than is needed to see that it still falls.
constexpr std::size_t kMostHeldOut = std::size_t{1} << 18;

}  // namespace

FlowTrainer::FlowTrainer(const CouplingFlow& flow, const TrainingSet& examples, const FlowTraining& settings,
                         std::uint64_t seed)
    : m_flow(flow), m_examples(examples), m_settings(settings), m_y(examples.dims()), m_order_seed(mix64(seed + 1)) {
  const std::size_t count = examples.size(), dims = examples.dims();
  if (settings.batch < 1) throw ConfigError(fmt::format("batch {}: must be at least 1", settings.batch));
  if (!(settings.held_out > 0 && settings.held_out < 1))
    throw ConfigError(fmt::format("held_out {}: must be between 0 and 1", settings.held_out));
  if (!(settings.jitter >= 0 && settings.jitter <= 10))
    throw ConfigError(fmt::format("jitter {}: must be between 0 and 10", settings.jitter));
  const std::size_t held_out =
      std::min(kMostHeldOut, static_cast<std::size_t>(settings.held_out * static_cast<double>(count)));
  if (held_out < 1 || count < held_out + 1)
    throw ConfigError(fmt::format("{} examples are too few to train a flow on", count));

  // The last rows are held out: copies of one candidate are adjacent, and must not stand on both sides.
  const std::size_t trained = count - held_out;
  m_order.reserve(trained);
  for (std::size_t i = 0; i < trained; ++i) {
    const float weight = examples.weight(i);
    if (!(weight > 0)) continue;
    m_order.push_back(static_cast<std::uint32_t>(i));
    m_mean_weight += static_cast<double>(weight);
  }
  m_held_out.resize(held_out, dims);
  for (std::size_t i = trained; i < count; ++i) {
    copy(i, examples.weight(i), m_held_out, i - trained);
    m_held_out_weight += static_cast<double>(examples.weight(i));
  }
  if (m_order.empty() || !(m_held_out_weight > 0)) throw ConfigError("no example has any weight: nothing to train on");
  m_mean_weight /= static_cast<double>(m_order.size());
  m_jitter = settings.jitter / std::sqrt(static_cast<double>(count));
  m_next = m_order.size();

  m_batch.resize(static_cast<std::size_t>(settings.batch), dims);
  next_batch();
}

void FlowTrainer::copy(std::size_t i, float weight, ExampleBlocks& to, std::size_t k, double width) {
  m_examples.primary_sample(i, m_y.data());
  if (width > 0) jitter(m_y, width, mix64(m_order_seed), m_jittered++);
  to.set(k, m_y, weight, m_examples.target(i));
}

// Fisher and Yates's shuffle.
std::uint32_t FlowTrainer::next_example() {
  if (m_next == m_order.size()) {
    const std::uint64_t key = sample_key(m_order_seed, m_epoch++);
    for (std::size_t i = m_order.size(); i > 1; --i)
      std::swap(m_order[i - 1], m_order[sample_bits(key, static_cast<std::uint32_t>(i)) % i]);
    m_next = 0;
  }
  return m_order[m_next++];
}

void FlowTrainer::next_batch() {
  const double scale = 1 / (m_mean_weight * m_settings.batch);
  for (std::size_t i = 0; i < static_cast<std::size_t>(m_settings.batch); ++i) {
    const std::uint32_t e = next_example();
    copy(e, static_cast<float>(static_cast<double>(m_examples.weight(e)) * scale), m_batch, i, m_jitter);
  }
}

double FlowTrainer::held_out_loss(const Floats& parameters) const {
  // No part of the loss is cut off here.
  const FlowObjective objective{m_settings.loss, m_settings.expected_uniform_share, 1e30};
  PackedParameters packed;
  m_flow.pack(parameters.data(), packed, false);
  std::vector<double> sums(m_held_out.count);
  const std::size_t chunk = 8, chunks = (m_held_out.count + chunk - 1) / chunk;
  parallel(chunks, [&](std::size_t i) {
    Floats scratch(m_flow.scratch_count());
    Floats d(kBlock);
    Doubles z(m_held_out.dims * kBlock), log_q(kBlock);
    for (std::size_t b = i * chunk; b < std::min(m_held_out.count, (i + 1) * chunk); ++b) {
      m_flow.inverse(packed, m_held_out.block_y(b), z.data(), log_q.data(), scratch.data());
      sums[b] = block_loss(objective, log_q.data(), m_held_out.block_weight(b), m_held_out.block_target(b), d.data());
    }
  });
  const double mean = std::accumulate(sums.begin(), sums.end(), 0.0) / m_held_out_weight;
  return m_settings.loss == FlowTraining::Loss::variance ? std::log(mean) : mean;
}

FlowTrainer::Result FlowTrainer::run(Floats start, FlowOptimiser::Pass pass) {
  FlowOptimiser optimiser(m_flow, std::move(start), m_settings, std::move(pass));
  TrainLog log;
  Floats best_parameters = optimiser.parameters();
  double best = held_out_loss(best_parameters), since = 0, rate = m_settings.rate;
  int bad = 0, drops = 0, losses = 0;
  log.points.push_back({m_clock.wall(), 0, best, best, m_clock.cpu()});
  log.stopped = "max_steps";
  for (int s = 1; s <= m_settings.max_steps; ++s) {
    if (g_interrupted) {
      if (log.points.size() < 2) throw Interrupted{};
      log.stopped = "interrupted";
      break;
    }
    if (s > 1) next_batch();
    since += optimiser.step(m_batch, rate);
    ++losses;
    if (s % m_settings.evaluate_every != 0 && s != m_settings.max_steps) continue;
    const double held_out = held_out_loss(optimiser.averaged());
    log.points.push_back({m_clock.wall(), static_cast<std::uint64_t>(s) * static_cast<std::uint64_t>(m_settings.batch),
                          since / losses, held_out, m_clock.cpu()});
    since = losses = 0;
    if (held_out < best) {
      best = held_out;
      bad = 0;
      best_parameters = optimiser.averaged();
    } else if (++bad >= m_settings.patience) {
      if (drops++ >= m_settings.rate_drops) {
        log.stopped = "held-out loss no longer falls";
        break;
      }
      rate /= 3;
      bad = 0;
    }
  }
  log.seconds = m_clock.wall();
  log.cpu_seconds = m_clock.cpu();
  return {std::move(best_parameters), std::move(log)};
}

}  // namespace warpath
