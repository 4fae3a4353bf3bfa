#include "train/fit_realnvp.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "core/interrupt.h"
#include "core/rng.h"
#include "nn/actnorm.h"
#include "train/fit_realnvp_optimiser.h"
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
  s.bins = 0;
  s.shared = false;
  s.loss = RealNvpSettings::Loss::likelihood;
  s.masks = RealNvpSettings::Masks::alternating;
  s.norm = RealNvpSettings::Norm::batch;
  return s;
}

namespace {

using nn::kBlock;
using Floats = nn::AlignedVector<float>;
using Doubles = nn::AlignedVector<double>;
using realnvp::parallel;

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

class Trainer {
 public:
  Trainer(const Examples& examples, const RealNvpSettings& settings, std::uint64_t seed, const Proposal* init);
  Fit run();

 private:
  Floats start_from(const Proposal& init) const;
  void initialise_norms(Floats& parameters) const;
  void next_batch();
  float weight(std::size_t i) const { return m_examples.weight.empty() ? 1.0f : m_examples.weight[i]; }
  /// g, up to a factor that is the same for all: weight times the density that the example was drawn from.
  float target(std::size_t i) const { return m_examples.inv_q.empty() ? weight(i) : weight(i) / m_examples.inv_q[i]; }
  double held_out_loss(const Floats& parameters);
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - m_start).count(); }

  const Examples& m_examples;
  RealNvpSettings m_settings;
  std::uint64_t m_seed;
  realnvp::Flow m_flow;
  std::chrono::steady_clock::time_point m_start = std::chrono::steady_clock::now();

  std::optional<realnvp::Optimiser> m_optimiser;
  realnvp::ExampleBlocks m_batch, m_held_out;
  double m_mean_weight = 0, m_held_out_weight = 0;
  std::optional<Shuffle> m_shuffle;
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

  // The last rows are held out: copies of one candidate are adjacent, and must not stand on both sides.
  const std::size_t trained = count - held_out;
  std::vector<std::uint32_t> rest;
  for (std::size_t i = 0; i < trained; ++i) {
    if (!(weight(i) > 0)) continue;
    rest.push_back(static_cast<std::uint32_t>(i));
    m_mean_weight += static_cast<double>(weight(i));
  }
  m_held_out.resize(held_out, dims);
  for (std::size_t i = trained; i < count; ++i) {
    m_held_out.set(i - trained, examples.y.batch().row(i), weight(i), target(i));
    m_held_out_weight += static_cast<double>(weight(i));
  }
  if (rest.empty() || !(m_held_out_weight > 0)) throw ConfigError("no example has any weight: nothing to train on");
  m_mean_weight /= static_cast<double>(rest.size());
  m_shuffle.emplace(std::move(rest), mix64(seed + 1));

  m_batch.resize(static_cast<std::size_t>(settings.batch), dims);
  next_batch();
  Floats parameters = init ? start_from(*init) : m_flow.initial(mix64(seed + 2));
  if (!init && settings.norm == RealNvpSettings::Norm::actnorm) initialise_norms(parameters);
  m_optimiser.emplace(m_flow, std::move(parameters), settings.average);
}

Floats Trainer::start_from(const Proposal& init) const {
  const auto* warp = dynamic_cast<const RealNvp*>(&init);
  if (!warp) throw ConfigError(fmt::format("a {} cannot start the training of a realnvp", init.family()));
  const RealNvpSettings &a = warp->settings(), &b = m_settings;
  const auto text = [](const RealNvpSettings& s, int dims) {
    return fmt::format("{}D, {} couplings x {}, {} blocks, {} bins, {}, {} masks, norm {}", dims, s.couplings, s.width,
                       s.blocks, s.bins, s.shared ? "shared" : "separate",
                       s.masks == RealNvpSettings::Masks::binary ? "binary" : "alternating", static_cast<int>(s.norm));
  };
  if (text(a, warp->dims()) != text(b, m_flow.dims()))
    throw ConfigError(fmt::format("the weights to start from are of a Real NVP of {}; this one has {}",
                                  text(a, warp->dims()), text(b, m_flow.dims())));
  return warp->parameters();
}

// Every coupling is the identity at the start, so that all of them see the examples themselves.
void Trainer::initialise_norms(Floats& parameters) const {
  const std::size_t blocks = m_batch.count;
  Floats v(blocks * m_batch.dims * kBlock);
  for (std::size_t i = 0; i < blocks * m_batch.dims; ++i)
    realnvp::logit(m_batch.y.data() + i * kBlock, v.data() + i * kBlock);
  parallel(m_flow.couplings().size(), [&](std::size_t c) {
    const realnvp::Coupling& coupling = m_flow.couplings()[c];
    const std::size_t inputs = static_cast<std::size_t>(coupling.nets[0].inputs());
    Floats x(blocks * inputs * kBlock);
    for (std::size_t b = 0; b < blocks; ++b)
      m_flow.encode_kept(coupling, v.data() + b * m_batch.dims * kBlock, x.data() + b * inputs * kBlock);
    for (std::size_t n = 0; n < coupling.nets.size(); ++n)
      nn::initialise_actnorm(coupling.nets[n], static_cast<int>(blocks), x.data(),
                             parameters.data() + coupling.parameters[n]);
  });
}

void Trainer::next_batch() {
  const double scale = 1 / (m_mean_weight * m_settings.batch);
  for (std::size_t i = 0; i < static_cast<std::size_t>(m_settings.batch); ++i) {
    const std::uint32_t e = m_shuffle->next();
    m_batch.set(i, m_examples.y.batch().row(e), static_cast<float>(static_cast<double>(weight(e)) * scale), target(e));
  }
}

double Trainer::held_out_loss(const Floats& parameters) {
  // No part of the loss is cut off here.
  const realnvp::Objective objective{m_settings.loss, m_settings.uniform, 1e30};
  realnvp::Packed packed;
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
  return m_settings.loss == RealNvpSettings::Loss::variance ? std::log(mean) : mean;
}

Fit Trainer::run() {
  Fit fit;
  Floats best_parameters = m_optimiser->parameters();
  double best = held_out_loss(best_parameters), since = 0, rate = m_settings.rate;
  int bad = 0, drops = 0, losses = 0;
  fit.log.points.push_back({seconds(), 0, best, best});
  fit.log.stopped = "max_steps";
  for (int s = 1; s <= m_settings.max_steps; ++s) {
    if (g_interrupted) {
      if (fit.log.points.size() < 2) throw Interrupted{};
      fit.log.stopped = "interrupted";
      break;
    }
    if (s > 1) next_batch();
    since += m_optimiser->step(m_batch, rate);
    ++losses;
    if (s % m_settings.evaluate_every != 0 && s != m_settings.max_steps) continue;
    const double held_out = held_out_loss(m_optimiser->averaged());
    fit.log.points.push_back({seconds(), static_cast<std::uint64_t>(s) * static_cast<std::uint64_t>(m_settings.batch),
                              since / losses, held_out});
    since = losses = 0;
    if (held_out < best) {
      best = held_out;
      bad = 0;
      best_parameters = m_optimiser->averaged();
    } else if (++bad >= m_settings.patience) {
      if (drops++ >= m_settings.rate_drops) {
        fit.log.stopped = "held-out loss no longer falls";
        break;
      }
      rate /= 3;
      bad = 0;
    }
  }
  fit.log.seconds = seconds();
  fit.proposal = std::make_shared<RealNvp>(m_flow, std::move(best_parameters));
  return fit;
}

}  // namespace

Fit fit_realnvp(const Examples& examples, const RealNvpSettings& settings, std::uint64_t seed, const Proposal* init) {
  return Trainer(examples, settings, seed, init).run();
}

}  // namespace warpath
