#include "train/fit_realnvp.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "core/floating_point.h"
#include "core/interrupt.h"
#include "core/rng.h"
#include "nn/actnorm.h"
#include "nn/adam.h"
#include "warp/realnvp.h"
#include "warp/realnvp_kernels.h"
#include "warpath/error.h"

namespace warpath {

RealNvpSettings released_realnvp() {
  RealNvpSettings s;
  s.couplings = 12;
  s.width = 512;
  s.blocks = 8;
  s.rate = 1e-4;
  s.norm = RealNvpSettings::Norm::batch;
  return s;
}

namespace {

using nn::kBlock;
using Floats = nn::AlignedVector<float>;
using Doubles = nn::AlignedVector<double>;

/// A batch's blocks are dealt out to this many gradients, which are then added in their order: so the sum does not
/// depend on threads. More would cost memory traffic, fewer would leave threads idle.
constexpr std::size_t kSlots = 8;

void parallel(std::size_t count, const auto& body) {
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, count, 1),
      [&](const tbb::blocked_range<std::size_t>& range) {
        const FlushDenormals flush;
        for (std::size_t i = range.begin(); i != range.end(); ++i) body(i);
      },
      tbb::simple_partitioner());
}

/// Indices of examples in an order of its own for every epoch, by Fisher and Yates's shuffle.
class Shuffle {
 public:
  Shuffle(std::vector<std::uint32_t> indices, std::uint64_t seed)
      : m_indices(std::move(indices)), m_seed(seed), m_next(m_indices.size()) {}
  std::uint32_t next() {
    if (m_next == m_indices.size()) {
      const std::uint64_t key = sample_key(m_seed, m_epoch++);
      for (std::size_t i = m_indices.size(); i > 1; --i)
        std::swap(m_indices[i - 1], m_indices[sample_bits(key, static_cast<std::uint32_t>(i)) % i]);
      m_next = 0;
    }
    return m_indices[m_next++];
  }

 private:
  std::vector<std::uint32_t> m_indices;
  std::uint64_t m_seed, m_epoch = 0;
  std::size_t m_next;
};

/// Examples as blocks of dims x kBlock doubles; what is left of the last block weighs nothing.
struct Blocks {
  std::size_t count = 0, dims = 0;
  Doubles y;
  Floats weight;

  void resize(std::size_t examples, std::size_t dimensions) {
    count = (examples + kBlock - 1) / kBlock;
    dims = dimensions;
    y.assign(count * dims * kBlock, 0.5);
    weight.assign(count * kBlock, 0.0f);
  }
  void set(std::size_t i, std::span<const float> example, float w) {
    const std::size_t block = i / kBlock, lane = i % kBlock;
    for (std::size_t d = 0; d < dims; ++d) y[(block * dims + d) * kBlock + lane] = static_cast<double>(example[d]);
    weight[i] = w;
  }
  const double* block_y(std::size_t b) const { return y.data() + b * dims * kBlock; }
  const float* block_weight(std::size_t b) const { return weight.data() + b * kBlock; }
};

class Trainer {
 public:
  Trainer(const Examples& examples, const RealNvpSettings& settings, std::uint64_t seed, const Proposal* init);
  Fit run();

 private:
  void start_from(const Proposal& init);
  void initialise_norms();
  void next_batch();
  double step();  ///< one step of Adam; the batch's loss
  double held_out_loss(const Floats& parameters);
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - m_start).count(); }

  const Examples& m_examples;
  RealNvpSettings m_settings;
  std::uint64_t m_seed;
  realnvp::Flow m_flow;
  std::chrono::steady_clock::time_point m_start = std::chrono::steady_clock::now();

  Floats m_parameters, m_average, m_best, m_gradients, m_m, m_v;
  realnvp::Packed m_packed;
  std::vector<Floats> m_scratch;  ///< one for each slot
  Blocks m_batch, m_held_out;
  double m_mean_weight = 0, m_held_out_weight = 0;
  std::optional<Shuffle> m_shuffle;
  nn::Adam m_adam;
  int m_step = 0;
};

Trainer::Trainer(const Examples& examples, const RealNvpSettings& settings, std::uint64_t seed, const Proposal* init)
    : m_examples(examples), m_settings(settings), m_seed(seed), m_flow(static_cast<int>(examples.y.cols()), settings) {
  const std::size_t count = examples.size(), dims = examples.y.cols();
  if (settings.batch < 1) throw ConfigError(fmt::format("batch {}: must be at least 1", settings.batch));
  if (!(settings.held_out > 0 && settings.held_out < 1))
    throw ConfigError(fmt::format("held_out {}: must be between 0 and 1", settings.held_out));
  const std::size_t held_out = static_cast<std::size_t>(settings.held_out * static_cast<double>(count));
  if (held_out < 1 || count < held_out + 1)
    throw ConfigError(fmt::format("{} examples are too few to train a Real NVP on", count));

  // The shuffle of epoch 0 also says which examples are held out.
  std::vector<std::uint32_t> all(count), rest;
  std::iota(all.begin(), all.end(), 0u);
  Shuffle deal(std::move(all), mix64(seed));
  m_held_out.resize(held_out, dims);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t e = deal.next();
    const float weight = examples.weight.empty() ? 1.0f : examples.weight[e];
    if (i < held_out) {
      m_held_out.set(i, examples.y.batch().row(e), weight);
      m_held_out_weight += static_cast<double>(weight);
    } else if (weight > 0) {
      rest.push_back(e);
      m_mean_weight += static_cast<double>(weight);
    }
  }
  if (rest.empty() || !(m_held_out_weight > 0)) throw ConfigError("no example has any weight: nothing to train on");
  m_mean_weight /= static_cast<double>(rest.size());
  m_shuffle.emplace(std::move(rest), mix64(seed + 1));

  m_batch.resize(static_cast<std::size_t>(settings.batch), dims);
  next_batch();
  if (init)
    start_from(*init);
  else {
    m_parameters = m_flow.initial(mix64(seed + 2));
    if (settings.norm == RealNvpSettings::Norm::actnorm) initialise_norms();
  }
  m_average = m_best = m_parameters;
  m_m.assign(m_parameters.size(), 0.0f);
  m_v = m_m;
  m_gradients.assign(kSlots * m_parameters.size(), 0.0f);
  m_scratch.assign(kSlots, Floats(m_flow.training_scratch_count()));
  m_flow.pack(m_parameters.data(), m_packed, true);
}

void Trainer::start_from(const Proposal& init) {
  const auto* warp = dynamic_cast<const RealNvp*>(&init);
  if (!warp) throw ConfigError(fmt::format("a {} cannot start the training of a realnvp", init.family()));
  const RealNvpSettings &a = warp->settings(), &b = m_settings;
  const auto text = [](const RealNvpSettings& s, int dims) {
    return fmt::format("{}D, {} couplings x {}, {} blocks, {}, norm {}", dims, s.couplings, s.width, s.blocks,
                       s.shared ? "shared" : "separate", static_cast<int>(s.norm));
  };
  if (text(a, warp->dims()) != text(b, m_flow.dims()))
    throw ConfigError(fmt::format("the weights to start from are of a Real NVP of {}; this one has {}",
                                  text(a, warp->dims()), text(b, m_flow.dims())));
  m_parameters = warp->parameters();
}

// Every coupling is the identity at the start, so that all of them see the examples themselves.
void Trainer::initialise_norms() {
  const std::size_t blocks = m_batch.count;
  Floats v(blocks * m_batch.dims * kBlock);
  for (std::size_t i = 0; i < blocks * m_batch.dims; ++i)
    realnvp::logit(m_batch.y.data() + i * kBlock, v.data() + i * kBlock);
  parallel(m_flow.couplings().size(), [&](std::size_t c) {
    const realnvp::Coupling& coupling = m_flow.couplings()[c];
    const std::size_t kept = coupling.kept.size();
    Floats x(blocks * kept * kBlock);
    for (std::size_t b = 0; b < blocks; ++b)
      for (std::size_t k = 0; k < kept; ++k)
        realnvp::encode(v.data() + (b * m_batch.dims + static_cast<std::size_t>(coupling.kept[k])) * kBlock,
                        x.data() + (b * kept + k) * kBlock);
    for (std::size_t n = 0; n < coupling.nets.size(); ++n)
      nn::initialise_actnorm(coupling.nets[n], static_cast<int>(blocks), x.data(),
                             m_parameters.data() + coupling.parameters[n]);
  });
}

void Trainer::next_batch() {
  const double scale = 1 / (m_mean_weight * m_settings.batch);
  for (std::size_t i = 0; i < static_cast<std::size_t>(m_settings.batch); ++i) {
    const std::uint32_t e = m_shuffle->next();
    const double weight = m_examples.weight.empty() ? 1.0 : static_cast<double>(m_examples.weight[e]);
    m_batch.set(i, m_examples.y.batch().row(e), static_cast<float>(weight * scale));
  }
}

double Trainer::step() {
  const std::size_t stride = m_parameters.size(), slots = std::min(kSlots, m_batch.count);
  std::array<double, kSlots> loss{};
  parallel(slots, [&](std::size_t slot) {
    const std::size_t first = slot * m_batch.count / slots, end = (slot + 1) * m_batch.count / slots;
    for (std::size_t b = first; b < end; ++b)
      loss[slot] += m_flow.train_block(m_packed, m_batch.block_y(b), m_batch.block_weight(b), m_settings.uniform,
                                       m_gradients.data() + slot * stride, b > first, m_scratch[slot].data());
  });
  ++m_step;
  const float keep = static_cast<float>(std::min(m_settings.average, m_step / (m_step + 10.0)));
  const auto update = [&](std::size_t from, std::size_t count) {
    nn::adam_step(m_adam, m_step, count, m_gradients.data() + from, m_parameters.data() + from, m_m.data() + from,
                  m_v.data() + from);
    nn::move_average(1 - keep, count, m_parameters.data() + from, m_average.data() + from);
  };
  parallel(m_flow.couplings().size(), [&](std::size_t c) {
    const realnvp::Coupling& coupling = m_flow.couplings()[c];
    const std::size_t from = coupling.parameters.front();
    const std::size_t end = c + 1 < m_flow.couplings().size() ? m_flow.couplings()[c + 1].parameters.front() : stride;
    nn::add_slots(static_cast<int>(slots), stride, end - from, m_gradients.data() + from);
    for (std::size_t n = 0; n < coupling.nets.size(); ++n)
      coupling.nets[n].unfold(m_parameters.data() + coupling.parameters[n],
                              m_gradients.data() + coupling.parameters[n]);
    update(from, end - from);
    m_flow.pack_coupling(c, m_parameters.data(), m_packed);
  });
  return std::accumulate(loss.begin(), loss.end(), 0.0);
}

double Trainer::held_out_loss(const Floats& parameters) {
  realnvp::Packed packed;
  m_flow.pack(parameters.data(), packed, false);
  std::vector<double> sums(m_held_out.count);
  const std::size_t chunk = 8, chunks = (m_held_out.count + chunk - 1) / chunk;
  parallel(chunks, [&](std::size_t i) {
    Floats scratch(m_flow.scratch_count());
    Doubles z(m_held_out.dims * kBlock), log_q(kBlock);
    for (std::size_t b = i * chunk; b < std::min(m_held_out.count, (i + 1) * chunk); ++b) {
      m_flow.inverse(packed, m_held_out.block_y(b), z.data(), log_q.data(), scratch.data());
      for (std::size_t s = 0; s < kBlock; ++s) {
        const double weight = static_cast<double>(m_held_out.block_weight(b)[s]);
        if (weight == 0) continue;
        const double density =
            m_settings.uniform > 0
                ? std::log((1 - m_settings.uniform) * std::exp(std::min(log_q[s], 700.0)) + m_settings.uniform)
                : log_q[s];
        sums[b] -= weight * density;
      }
    }
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0) / m_held_out_weight;
}

Fit Trainer::run() {
  Fit fit;
  double best = held_out_loss(m_parameters), since = 0;
  int bad = 0, drops = 0, losses = 0;
  m_adam.rate = static_cast<float>(m_settings.rate);
  fit.log.points.push_back({seconds(), 0, best, best});
  fit.log.stopped = "max_steps";
  for (int s = 1; s <= m_settings.max_steps; ++s) {
    if (g_interrupted) {
      if (fit.log.points.size() < 2) throw Interrupted{};
      fit.log.stopped = "interrupted";
      break;
    }
    if (s > 1) next_batch();
    since += step();
    ++losses;
    if (s % m_settings.evaluate_every != 0 && s != m_settings.max_steps) continue;
    const double held_out = held_out_loss(m_average);
    fit.log.points.push_back({seconds(), static_cast<std::uint64_t>(s) * static_cast<std::uint64_t>(m_settings.batch),
                              since / losses, held_out});
    since = losses = 0;
    if (held_out < best) {
      best = held_out;
      bad = 0;
      m_best = m_average;
    } else if (++bad >= m_settings.patience) {
      if (drops++ >= m_settings.rate_drops) {
        fit.log.stopped = "held-out likelihood no longer rises";
        break;
      }
      m_adam.rate /= 3;
      bad = 0;
    }
  }
  fit.log.seconds = seconds();
  fit.proposal = std::make_shared<RealNvp>(std::move(m_flow), std::move(m_best));
  return fit;
}

}  // namespace

Fit fit_realnvp(const Examples& examples, const RealNvpSettings& settings, std::uint64_t seed, const Proposal* init) {
  return Trainer(examples, settings, seed, init).run();
}

}  // namespace warpath
