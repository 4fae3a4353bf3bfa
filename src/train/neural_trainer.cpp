#include "train/neural_trainer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "core/parallel.h"
#include "core/rng.h"
#include "core/vertex_context_buffer.h"
#include "nn/adam.h"
#include "nn/dense.h"
#include "train/scattering_stride.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using nn::kBlock;

/// A batch's blocks are dealt out to this many gradients, which are then added in their order: so the sum does not
/// depend on threads.
constexpr std::size_t kSlots = 8;
/// Vertices kept of a pass, about: 84 bytes each.
constexpr double kMostVertices = 2e6;
constexpr std::uint64_t kWeightStream = 0x6e657572616c0006u;
constexpr std::array kBoth{VertexNumbers::light, VertexNumbers::scatter};

}  // namespace

/// What a pass leaves of a vertex.
struct NeuralTrainer::Example {
  Vertex vertex;
  std::array<std::uint16_t, 2> bin;  // of its numbers: light, scatter
  std::array<float, 2> weight;
};

/// Mean of what came back in each cell of the field: light, scatter.
struct NeuralTrainer::Means {
  std::array<std::vector<float>, 2> of;
};

struct NeuralTrainer::Scratch {
  nn::AlignedVector<float> activations, h, transposed_h, d_h, backward;
  VertexContextBuffer context;
  std::array<std::uint32_t, kBlock> cells;
};

class NeuralTrainer::Recorder final : public VertexRecorder {
 public:
  Recorder(std::unique_ptr<VertexRecorder> of_field, const FieldGrids& grids, std::shared_ptr<const Field> field,
           std::shared_ptr<const Means> means, const NeuralSettings& settings, double level)
      : field_recorder(std::move(of_field)),
        m_grids(grids),
        m_field(std::move(field)),
        m_means(std::move(means)),
        m_numbers(settings.numbers),
        m_clip(static_cast<float>(settings.clip)),
        m_level(static_cast<float>(level)) {}

  void record(const VertexRecords& records) override {
    const bool lights = holds_vertex_numbers(m_numbers, VertexNumbers::light, records.bounce);
    const bool scatters = holds_vertex_numbers(m_numbers, VertexNumbers::scatter, records.bounce);
    if (!lights && !scatters) return;
    field_recorder->record(records);
    const std::size_t n = records.lanes.size();
    seen += static_cast<double>(n);
    if (!m_field) return;
    m_cells.resize(std::max(m_cells.size(), n));
    m_field->locate(records.context, n, m_cells.data());
    for (std::size_t i = 0; i < n; ++i)
      if (m_cells[i] != FieldTree::kNoCell) consider(records, i, m_cells[i], lights, scatters);
  }

  std::unique_ptr<VertexRecorder> field_recorder;
  std::vector<Example> examples;
  double seen = 0;

 private:
  void consider(const VertexRecords& records, std::size_t i, std::uint32_t cell, bool lights, bool scatters) {
    const auto& u = records.numbers;
    const auto kind = static_cast<SurfaceKind>(records.context.kind[i]);
    lights = lights && kind != SurfaceKind::delta && kind != SurfaceKind::null;
    const auto weigh = [&](float term, VertexNumbers which) {
      const float mean = m_means->of[static_cast<std::size_t>(which)][cell];
      return term > 0 && std::isfinite(term) ? std::min(term / std::max(mean, 1e-30f), m_clip) : 0.0f;
    };
    std::array<float, 2> weight{lights ? weigh(records.light[i], VertexNumbers::light) : 0.0f,
                                scatters ? weigh(records.beyond[i], VertexNumbers::scatter) : 0.0f};
    const float sum = weight[0] + weight[1];
    if (!(sum > 0)) return;
    if (sum < m_level) {
      // Chance that belongs to the vertex, whatever thread it came from.
      const auto bits = [&](std::size_t d) { return std::uint64_t{std::bit_cast<std::uint32_t>(u[d][i])}; };
      const auto x = std::bit_cast<std::uint32_t>(records.context.position[0][i]);
      if (sample_float(sample_key(bits(3) << 32 | bits(4), bits(5)), x) * m_level >= sum) return;
      for (float& w : weight) w *= m_level / sum;
    }
    Example v;
    v.vertex = Vertex(records.context, i);
    v.bin = {static_cast<std::uint16_t>(m_grids.light.bin(u[0][i], u[1][i], u[2][i])),
             static_cast<std::uint16_t>(m_grids.grid(VertexNumbers::scatter, kind).bin(u[3][i], u[4][i], u[5][i]))};
    v.weight = weight;
    examples.push_back(v);
  }

  const FieldGrids& m_grids;
  const std::shared_ptr<const Field> m_field;
  const std::shared_ptr<const Means> m_means;
  const Layout& m_numbers;
  const float m_clip, m_level;
  std::vector<std::uint32_t> m_cells;  // of the vertices of one bounce
};

NeuralTrainer::NeuralTrainer(const NeuralSettings& settings, int light_parts, std::uint64_t seed)
    : m_settings(settings),
      m_field_trainer(settings.field, light_parts),
      m_network(std::make_shared<const VertexNetwork>(light_parts, settings)),
      m_parameters(m_network->initial(mix64(seed ^ kWeightStream))),
      m_m(m_parameters.size(), 0.0f),
      m_v(m_m),
      m_gradients(kSlots * m_parameters.size()),
      m_packed(m_network->trunk().packed_count()),
      m_packed_back(m_network->trunk().packed_back_count()),
      m_scratch(kSlots) {
  check_vertex_numbers(settings.numbers);
  if (settings.batch < kBlock) throw ConfigError(fmt::format("batch {}: must be at least {}", settings.batch, kBlock));
  const nn::ResidualNet& trunk = m_network->trunk();
  const auto rows = [](int count) { return static_cast<std::size_t>(count * kBlock); };
  for (Scratch& s : m_scratch) {
    s.activations.resize(trunk.activation_count());
    for (auto* h : {&s.h, &s.transposed_h, &s.d_h}) h->resize(rows(kNodeFeatures));
    s.backward.resize(trunk.scratch_count());
  }
  std::size_t nodes = 0;
  for (std::size_t h = 0; h < VertexNetwork::kHeads; ++h) nodes += m_network->tree(h).nodes();
  m_transposed.resize(nodes * NodeTree::kChildren * kNodeFeatures);
}

NeuralTrainer::~NeuralTrainer() = default;

std::unique_ptr<VertexRecorder> NeuralTrainer::make_recorder() const {
  return std::make_unique<Recorder>(m_field_trainer.make_recorder(m_field), m_network->grids(), m_field, m_means,
                                    m_settings, m_level);
}

void NeuralTrainer::merge(VertexRecorder& recorder) {
  auto& r = static_cast<Recorder&>(recorder);
  m_field_trainer.merge(*r.field_recorder);
  m_examples.insert(m_examples.end(), r.examples.begin(), r.examples.end());
  m_seen += r.seen;
  r.examples.clear();
  r.seen = 0;
}

void NeuralTrainer::find_box() {
  std::array<std::vector<float>, 3> positions;
  for (std::size_t a = 0; a < 3; ++a)
    for (const Example& example : m_examples) positions[a].push_back(example.vertex.values[a]);
  m_box = box_around(std::move(positions));
}

void NeuralTrainer::gradients_of_slot(std::size_t slot, std::size_t first, std::size_t stride) {
  const VertexNetwork& network = *m_network;
  const nn::ResidualNet& trunk = network.trunk();
  Scratch& s = m_scratch[slot];
  float* gradients = m_gradients.data() + slot * m_parameters.size();
  std::fill_n(gradients, m_parameters.size(), 0.0f);
  const auto blocks = static_cast<std::size_t>(m_settings.batch / kBlock);
  alignas(64) std::array<float, kNodeFeatures> h, d_h;
  std::array<std::uint32_t, kBlock> vertices;
  std::iota(vertices.begin(), vertices.end(), 0u);
  for (std::size_t b = slot * blocks / kSlots; b < (slot + 1) * blocks / kSlots; ++b) {
    const auto example = [&](std::size_t k) -> const Example& {
      return m_examples[(first + (b * kBlock + k) * stride) % m_examples.size()];
    };
    s.context.clear();
    for (std::size_t k = 0; k < kBlock; ++k) s.context.add(example(k).vertex);
    const VertexContext context = s.context.view();
    m_field->locate(context, kBlock, s.cells.data());
    encode_vertices(m_box, network.shape().position_bins, context, vertices, s.activations.data());
    trunk.forward(m_packed.data(), s.activations.data(), s.h.data());
    nn::transpose(kNodeFeatures, s.h.data(), s.transposed_h.data());
    for (std::size_t k = 0; k < kBlock; ++k) {
      const Example& v = example(k);
      for (std::size_t f = 0; f < kNodeFeatures; f += 16)
        std::copy_n(s.transposed_h.data() + f * kBlock + k * 16, 16, h.data() + f);
      d_h = {};
      for (const VertexNumbers which : kBoth) {
        const auto w = static_cast<std::size_t>(which);
        if (!(v.weight[w] > 0)) continue;
        const std::size_t head = VertexNetwork::head_of(which, static_cast<SurfaceKind>(v.vertex.kind));
        const std::size_t at = network.first_of_head(head);
        train_nodes(network.tree(head), m_parameters.data() + at, m_transposed_head[head],
                    m_field->density(which, s.cells[k]), h.data(), v.bin[w], v.weight[w], gradients + at, d_h.data());
      }
      for (std::size_t f = 0; f < kNodeFeatures; ++f) s.d_h[f * kBlock + k] = d_h[f];
    }
    trunk.backward(m_packed_back.data(), s.activations.data(), s.d_h.data(), gradients, true, nullptr, false,
                   s.backward.data());
  }
}

void NeuralTrainer::step(std::size_t first, std::size_t stride, double rate) {
  const nn::ResidualNet& trunk = m_network->trunk();
  trunk.pack_for_training(m_parameters.data(), m_packed.data(), m_packed_back.data());
  float* to = m_transposed.data();
  for (std::size_t h = 0; h < VertexNetwork::kHeads; ++h) {
    transpose_nodes(m_network->tree(h), m_parameters.data() + m_network->first_of_head(h), to);
    m_transposed_head[h] = to;
    to += m_network->tree(h).nodes() * NodeTree::kChildren * kNodeFeatures;
  }
  parallel(kSlots, [&](std::size_t slot) { gradients_of_slot(slot, first, stride); });
  ++m_steps;
  const nn::Adam adam{.rate = static_cast<float>(rate), .beta2 = 0.99f, .epsilon = 1e-12f};
  const std::size_t size = m_parameters.size(), chunk = 4096, chunks = (size + chunk - 1) / chunk;
  parallel(chunks, [&](std::size_t c) {
    const std::size_t from = c * chunk, count = std::min(chunk, size - from);
    nn::add_slots(kSlots, size, count, m_gradients.data() + from);
    nn::adam_step(adam, m_steps, count, m_gradients.data() + from, m_parameters.data() + from, m_m.data() + from,
                  m_v.data() + from);
  });
}

void NeuralTrainer::train() {
  const std::size_t n = m_examples.size(), batch = static_cast<std::size_t>(m_settings.batch);
  if (n < batch) return;
  if (m_steps == 0) find_box();
  // Each once, or twice where there are few.
  const std::size_t visits = std::max(n, std::min(2 * n, static_cast<std::size_t>(m_settings.min_visits)));
  const std::size_t steps = visits / batch;
  const std::size_t stride = scattering_stride(n);
  for (std::size_t s = 0; s < steps; ++s) {
    const double rate = m_settings.rate * std::pow(0.1, static_cast<double>(s) / static_cast<double>(steps));
    step(s * batch % n * stride % n, stride, rate);
  }
}

void NeuralTrainer::fit_field() {
  m_field = m_field_trainer.fit();
  auto means = std::make_shared<Means>();
  for (const VertexNumbers which : kBoth)
    for (std::uint32_t cell = 0; cell < m_field->tree().cells(); ++cell)
      means->of[static_cast<std::size_t>(which)].push_back(static_cast<float>(m_field_trainer.mean(which, cell)));
  m_means = std::move(means);
}

std::shared_ptr<const Neural> NeuralTrainer::fit() {
  if (m_field) train();
  m_examples.clear();
  fit_field();
  // The next pass is as large as all before it; the two w of a vertex are 1 on average.
  const double wanted = std::max(static_cast<double>(m_settings.min_visits), m_settings.visits * m_seen);
  m_level = 2 * m_seen / std::min(wanted, kMostVertices);
  return std::make_shared<Neural>(m_field, m_network, m_box, m_parameters, m_settings.numbers);
}

}  // namespace warpath
