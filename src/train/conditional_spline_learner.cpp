#include "train/conditional_spline_learner.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "core/rng.h"
#include "core/streams.h"
#include "path/vertex.h"
#include "train/scattering_stride.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using nn::kBlock;
constexpr std::array kBoth{VertexDecision::light_sampling, VertexDecision::scattering};
constexpr std::size_t kMostVisits = 8;  // of each example after a pass: with more, the first few are learned by heart

float finite(float x) { return x > 0 && std::isfinite(x) ? x : 0.0f; }

}  // namespace

/// Numbers that were drawn at a vertex, and what they brought.
struct ConditionalSplineLearner::Example {
  Vertex vertex;
  std::array<float, 3> y;
  float f;       // what came back, over the throughput
  float weight;  // f / p, over the probability with which the example is kept
};

/// What comes back to the vertices of a place on the film, on average.
class ConditionalSplineLearner::Brightness {
 public:
  static std::size_t tile(float x, float y) { return coordinate(y) * kTiles + coordinate(x); }
  void add(std::size_t tile, double value) {
    m_sum[tile] += value;
    m_count[tile] += 1;
  }
  void operator+=(const Brightness& other) {
    for (std::size_t t = 0; t < m_sum.size(); ++t) m_sum[t] += other.m_sum[t], m_count[t] += other.m_count[t];
  }
  void clear() { m_sum = {}, m_count = {}; }
  /// Tiles of few vertices are drawn to the mean of all; 0 if nothing came back anywhere.
  double at(std::size_t tile) const { return (m_sum[tile] + kLikeAll * m_mean) / (m_count[tile] + kLikeAll); }
  /// To be called once all is added.
  void settle() {
    const double count = std::accumulate(m_count.begin(), m_count.end(), 0.0);
    m_mean = count > 0 ? std::accumulate(m_sum.begin(), m_sum.end(), 0.0) / count : 0;
  }

 private:
  static constexpr std::size_t kTiles = 48;  // along each side of the film
  static constexpr double kLikeAll = 16;     // vertices
  static std::size_t coordinate(float x) {
    return std::min(static_cast<std::size_t>(std::max(x, 0.0f) * kTiles), kTiles - 1);
  }
  std::array<double, kTiles * kTiles> m_sum{}, m_count{};
  double m_mean = 0;
};

/// Keeps an example that weighs less than `level` with a probability of what it has of that. Chance belongs to its
/// numbers, whatever thread they came from, and to the level.
bool ConditionalSplineLearner::survives(Example& example, double level) {
  if (!(example.weight < level)) return true;
  const auto bits = [](float x) { return std::uint64_t{std::bit_cast<std::uint32_t>(x)}; };
  const std::uint64_t key = sample_key(bits(example.y[0]) << 32 | bits(example.y[1]), bits(example.y[2]));
  const auto salt = std::bit_cast<std::uint32_t>(static_cast<float>(level));
  if (sample_double(key, salt) * level >= static_cast<double>(example.weight)) return false;
  example.weight = static_cast<float>(level);
  return true;
}

class ConditionalSplineLearner::Recorder final : public VertexRecorder {
 public:
  Recorder(const Layout& numbers, std::shared_ptr<const Brightness> before, double level)
      : m_numbers(numbers), m_before(std::move(before)), m_level(level) {}

  void record(const VertexRecords& records) override {
    const std::array<bool, 2> warped{holds_decision(m_numbers, VertexDecision::light_sampling, records.bounce),
                                     holds_decision(m_numbers, VertexDecision::scattering, records.bounce)};
    if (!warped[0] && !warped[1]) return;
    const std::size_t n = records.lanes.size();
    seen += static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t tile = Brightness::tile(records.context.film[0][i], records.context.film[1][i]);
      const std::array<float, 2> found{finite(records.light_return[i]), finite(records.scatter_return[i])};
      brightness.add(tile, static_cast<double>(found[0]) + static_cast<double>(found[1]));
      const double around = m_before ? m_before->at(tile) : 0;
      for (const VertexDecision which : kBoth) {
        const auto w = static_cast<std::size_t>(which);
        if (warped[w] && found[w] > 0) keep(records, i, which, found[w], around);
      }
    }
  }

  std::array<Examples, 2> examples;
  Brightness brightness;
  double seen = 0;

 private:
  void keep(const VertexRecords& records, std::size_t i, VertexDecision which, float found, double around) {
    const std::size_t first = which == VertexDecision::light_sampling ? 0 : 3;
    Example example{{}, {}, found, found};
    for (std::size_t a = 0; a < 3; ++a) example.y[a] = records.numbers[first + a][i];
    example.f /= which == VertexDecision::light_sampling ? records.inv_q_light[i] : records.inv_q_scatter[i];
    if (!survives(example, m_level * around)) return;
    example.vertex = records.context.at(i);
    examples[static_cast<std::size_t>(which)].push_back(example);
  }

  const Layout& m_numbers;
  const std::shared_ptr<const Brightness> m_before;
  const double m_level;
};

ConditionalSplineLearner::ConditionalSplineLearner(const ConditionalSplineSettings& settings, double uniform,
                                                   std::uint64_t seed)
    : m_settings(settings),
      m_uniform(uniform),
      m_shape(
          std::make_shared<const ConditionalSpline::Shape>(settings.flow, settings.position_bins, settings.film_bins)),
      m_optimisers([&] {
        FlowTraining training = settings.flow;
        training.expected_uniform_share = uniform;
        const spline::Flow& flow = m_shape->flow;
        return std::array{FlowOptimiser(flow, flow.initial(mix64(seed ^ kWeightStream)), training),
                          FlowOptimiser(flow, flow.initial(mix64(seed ^ kWeightStream) + 1), training)};
      }()),
      m_brightness(std::make_unique<Brightness>()) {
  if (settings.numbers.dims() == 0) throw ConfigError("a conditional spline needs to be told which numbers it warps");
  check_decisions(settings.numbers);
  if (settings.flow.batch < kBlock)
    throw ConfigError(fmt::format("batch {}: must be at least {}", settings.flow.batch, kBlock));
  if (settings.most_examples < 1) throw ConfigError("a conditional spline must keep at least 1 example");
  if (!(uniform >= 0 && uniform < 1))
    throw ConfigError(fmt::format("the share of uniform samples is {}, not in [0, 1)", uniform));
}

ConditionalSplineLearner::~ConditionalSplineLearner() = default;

std::unique_ptr<VertexRecorder> ConditionalSplineLearner::make_recorder() const {
  return std::make_unique<Recorder>(m_settings.numbers, m_brightness_of_pass, m_level);
}

void ConditionalSplineLearner::merge(VertexRecorder& recorder) {
  auto& r = static_cast<Recorder&>(recorder);
  for (std::size_t w = 0; w < m_examples.size(); ++w) {
    m_examples[w].insert(m_examples[w].end(), r.examples[w].begin(), r.examples[w].end());
    r.examples[w].clear();
  }
  *m_brightness += r.brightness;
  r.brightness.clear();
  m_seen += r.seen;
  r.seen = 0;
}

void ConditionalSplineLearner::thin(Examples& examples, double level) const {
  std::erase_if(examples, [&](Example& example) {
    return !survives(example,
                     level * m_brightness->at(Brightness::tile(example.vertex.film[0], example.vertex.film[1])));
  });
}

void ConditionalSplineLearner::train(std::size_t which, std::size_t visits) {
  const Examples& examples = m_examples[which];
  const auto batch_size = static_cast<std::size_t>(m_settings.flow.batch);
  const std::size_t n = examples.size();
  if (n < batch_size) return;
  const std::size_t steps = std::max<std::size_t>(1, std::min(visits, kMostVisits * n) / batch_size);
  ExampleBlocks batch;
  batch.resize(batch_size, 3, static_cast<std::size_t>(m_shape->flow.context_rows()));
  std::vector<VertexBuffer> buffers(batch.count);
  const std::size_t stride = scattering_stride(n);
  const auto first_step = static_cast<std::size_t>(m_optimisers[which].steps());
  for (std::size_t step = 0; step < steps; ++step) {
    const auto example = [&](std::size_t i) -> const Example& {
      return examples[((first_step + step) * batch_size + i) % n * stride % n];
    };
    // Each in units of the brightness around it.
    std::vector<float> weights(batch_size);
    parallel(batch.count, [&](std::size_t b) {
      VertexBuffer& buffer = buffers[b];
      buffer.clear();
      const std::size_t count = std::min<std::size_t>(kBlock, batch_size - b * kBlock);
      for (std::size_t s = 0; s < count; ++s) {
        const std::size_t i = b * kBlock + s;
        const Example& e = example(i);
        const double around = m_brightness->at(Brightness::tile(e.vertex.film[0], e.vertex.film[1]));
        weights[i] = static_cast<float>(std::min(static_cast<double>(e.weight) / around, m_settings.clip));
        batch.set(i, e.y, weights[i], static_cast<float>(static_cast<double>(e.f) / around));
        buffer.add(e.vertex);
      }
      std::array<std::uint32_t, kBlock> all;
      std::iota(all.begin(), all.end(), 0u);
      m_shape->encode(*m_box, buffer.view(), std::span(all).first(count), batch.block_context(b));
    });
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    for (std::size_t i = 0; i < batch_size; ++i) batch.weight[i] = static_cast<float>(weights[i] / sum);
    m_optimisers[which].step(batch, m_settings.flow.rate);
  }
}

std::shared_ptr<const ConditionalSpline> ConditionalSplineLearner::fit_flows() {
  m_brightness->settle();
  m_brightness_of_pass = std::make_shared<const Brightness>(*m_brightness);
  const double seen_now = std::exchange(m_seen_before, m_seen);
  const auto visits = std::max(static_cast<std::size_t>(m_settings.min_visits),
                               static_cast<std::size_t>(m_settings.visits * (m_seen - seen_now)));
  if (!m_box && !m_examples[0].empty() + !m_examples[1].empty() > 0) {
    std::array<std::vector<float>, 3> positions;
    for (const Examples& examples : m_examples)
      for (const Example& example : examples)
        for (std::size_t a = 0; a < 3; ++a) positions[a].push_back(example.vertex.position[a]);
    m_box = box_around(std::move(positions));
  }
  for (std::size_t w = 0; w < m_examples.size(); ++w) train(w, visits);
  // The next pass is as large as all before it; f / p is 1 on average, in units of the brightness around it.
  m_level = std::max(m_level, 2 * m_seen / m_settings.most_examples);
  for (Examples& examples : m_examples) thin(examples, m_level);
  return std::make_shared<ConditionalSpline>(m_shape, m_box.value_or(VertexBox{}),
                                             std::array{m_optimisers[0].averaged(), m_optimisers[1].averaged()},
                                             m_uniform, m_settings.numbers);
}

}  // namespace warpath
