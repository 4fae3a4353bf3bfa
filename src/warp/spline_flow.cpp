#include "warp/spline_flow.h"

#include <algorithm>
#include <utility>

#include "core/rng.h"
#include "nn/dense.h"
#include "warp/spline_kernels.h"
#include "warpath/error.h"

namespace warpath::spline {
namespace {

using nn::kBlock;

template <class T>
T* row(T* rows, std::size_t r) {
  return rows + r * kBlock;
}
template <class T>
T* row(T* rows, int r) {
  return row(rows, static_cast<std::size_t>(r));
}

/// Which dimensions a coupling sees, and which it moves.
struct Split {
  std::vector<int> kept, moved;
};

std::vector<Split> splits(int dims, const SplineSettings& settings) {
  std::vector<Split> splits;
  if (settings.masks == SplineSettings::Masks::binary) {
    for (int c = 0; c < settings.couplings; ++c) {
      Split& split = splits.emplace_back();
      const std::vector<bool> moves = binary_mask(dims, c);
      for (int i = 0; i < dims; ++i) (moves[static_cast<std::size_t>(i)] ? split.moved : split.kept).push_back(i);
    }
    return splits;
  }
  // The last coupling is the first that y goes through: it must move the dimension that no other one sees.
  for (int layer = 0; layer < settings.couplings; ++layer)
    for (int k = 0; k < dims; ++k) {
      Split& split = splits.emplace_back();
      const auto place = [&](int i) { return layer % 2 == 0 ? i : dims - 1 - i; };
      for (int i = 0; i < k; ++i) split.kept.push_back(place(i));
      split.moved.push_back(place(k));
    }
  return splits;
}

}  // namespace

Flow::Flow(int dims, const SplineSettings& settings, int context_rows)
    : m_dims(dims), m_context_rows(context_rows), m_settings(settings) {
  if (settings.couplings < 1) throw ConfigError(fmt::format("couplings {}: must be at least 1", settings.couplings));
  if (settings.bins < 2 || settings.bins > kMostBins)
    throw ConfigError(fmt::format("bins {}: must be 2 to {}", settings.bins, kMostBins));
  if (settings.encoding_bins < 0)
    throw ConfigError(fmt::format("encoding bins {}: must not be negative", settings.encoding_bins));
  WARPATH_CHECK(dims >= 1);
  std::vector<Split> all = splits(dims, settings);
  for (std::size_t c = 0; c < all.size(); ++c) {
    Split& split = all[c];
    Coupling coupling;
    for (std::size_t before = c + 1; before < all.size(); ++before)
      coupling.sees_moved |= std::find_first_of(split.kept.begin(), split.kept.end(), all[before].moved.begin(),
                                                all[before].moved.end()) != split.kept.end();
    coupling.kept = std::move(split.kept);
    coupling.moved = std::move(split.moved);
    // A single dimension without a context has nothing to be conditioned on: its network has no inputs.
    const int kept = static_cast<int>(coupling.kept.size());
    coupling.net =
        nn::ResidualNet(context_rows + kept * encoded_rows(settings.encoding_bins), settings.width, settings.blocks,
                        static_cast<int>(coupling.moved.size()) * head_rows(settings.bins), nn::Norm::none);
    coupling.parameters = std::exchange(m_parameters, m_parameters + coupling.net.parameter_count());
    coupling.packed = std::exchange(m_packed, m_packed + coupling.net.packed_count());
    coupling.packed_back = std::exchange(m_packed_back, m_packed_back + coupling.net.packed_back_count());
    coupling.activations = std::exchange(m_activations, m_activations + coupling.net.activation_count());
    m_most_inputs = std::max(m_most_inputs, static_cast<std::size_t>(coupling.net.inputs()));
    m_most_outputs = std::max(m_most_outputs, static_cast<std::size_t>(coupling.net.outputs()));
    m_backward_scratch = std::max(m_backward_scratch, coupling.net.scratch_count());
    m_couplings.push_back(std::move(coupling));
  }
}

std::size_t Flow::first_parameter(std::size_t c) const {
  return c < m_couplings.size() ? m_couplings[c].parameters : m_parameters;
}

std::vector<ParameterView> Flow::views() const {
  std::vector<ParameterView> views;
  for (std::size_t c = 0; c < m_couplings.size(); ++c)
    for (std::size_t l = 0; l < m_couplings[c].net.layers().size(); ++l) {
      const nn::DenseLayer& layer = m_couplings[c].net.layers()[l];
      const std::string name = fmt::format("coupling{}.layer{}.", c, l);
      const std::size_t at = m_couplings[c].parameters, rows = static_cast<std::size_t>(layer.outputs);
      views.push_back({name + "weight", at + layer.weight, rows, static_cast<std::size_t>(layer.inputs),
                       static_cast<std::size_t>(nn::padded_inputs(layer.inputs))});
      views.push_back({name + "bias", at + layer.bias, rows, 1, 1});
    }
  return views;
}

std::size_t Flow::multiply_adds() const {
  std::size_t sum = 0;
  for (const Coupling& coupling : m_couplings) sum += coupling.net.multiply_adds();
  return sum;
}

nn::AlignedVector<float> Flow::initial(std::uint64_t seed) const {
  nn::AlignedVector<float> parameters(m_parameters, 0.0f);
  for (std::size_t c = 0; c < m_couplings.size(); ++c)
    m_couplings[c].net.initialise(parameters.data() + m_couplings[c].parameters, sample_key(seed, c), 0.0f);
  return parameters;
}

void Flow::resize(PackedParameters& packed, bool back) const {
  packed.forward.resize(m_packed);
  packed.back.resize(back ? m_packed_back : 0);
}

void Flow::pack_coupling(std::size_t c, const float* parameters, PackedParameters& packed) const {
  const Coupling& coupling = m_couplings[c];
  const float* const from = parameters + coupling.parameters;
  float* const forward = packed.forward.data() + coupling.packed;
  if (packed.back.empty()) return coupling.net.pack(from, forward);
  coupling.net.pack_for_training(from, forward, packed.back.data() + coupling.packed_back);
}

void Flow::put_context(const float* context, float* x) const {
  if (m_context_rows > 0) std::copy_n(context, m_context_rows * kBlock, x);
}

void Flow::encode_kept(const Coupling& coupling, const float* v, float* x) const {
  for (std::size_t k = 0; k < coupling.kept.size(); ++k)
    encode(m_settings.encoding_bins, row(v, coupling.kept[k]),
           row(x, m_context_rows + static_cast<int>(k) * encoded_rows(m_settings.encoding_bins)));
}

// Density in doubles, heads, numbers to encode, inputs, and what ResidualNet::infer needs.
std::size_t Flow::scratch_count() const {
  return (2 + m_most_outputs + 1 + m_most_inputs + 2 * static_cast<std::size_t>(m_settings.width)) * kBlock;
}

void Flow::condition(const Coupling& coupling, const PackedParameters& packed, const double* v, float* scratch,
                     float* heads) const {
  float* const narrowed = scratch;
  float* const x = row(narrowed, 1);
  float* const rest = row(x, m_most_inputs);
  for (std::size_t k = 0; k < coupling.kept.size(); ++k) {
    narrow(row(v, coupling.kept[k]), narrowed);
    encode(m_settings.encoding_bins, narrowed,
           row(x, m_context_rows + static_cast<int>(k) * encoded_rows(m_settings.encoding_bins)));
  }
  coupling.net.infer(packed.forward.data() + coupling.packed, x, rest, heads);
}

void Flow::forward(const PackedParameters& packed, const double* z, const float* context, double* y, double* log_det,
                   float* scratch) const {
  double* const density = reinterpret_cast<double*>(scratch);
  float* const heads = row(scratch, 2);
  float* const rest = row(heads, m_most_outputs);
  put_context(context, row(rest, 1));
  if (y != z) std::copy_n(z, m_dims * kBlock, y);
  std::fill_n(density, kBlock, 1.0);
  std::fill_n(log_det, kBlock, 0.0);
  for (const Coupling& coupling : m_couplings) {
    condition(coupling, packed, y, rest, heads);
    for (std::size_t k = 0; k < coupling.moved.size(); ++k)
      stretch(m_settings.bins, row(heads, static_cast<int>(k) * head_rows(m_settings.bins)), row(y, coupling.moved[k]),
              density);
    take_log(density, log_det);
  }
  for (int i = 0; i < kBlock; ++i) log_det[i] = -log_det[i];
}

void Flow::inverse(const PackedParameters& packed, const double* y, const float* context, double* z, double* log_det,
                   float* scratch) const {
  double* const density = reinterpret_cast<double*>(scratch);
  float* const heads = row(scratch, 2);
  float* const rest = row(heads, m_most_outputs);
  put_context(context, row(rest, 1));
  if (z != y) std::copy_n(y, m_dims * kBlock, z);
  std::fill_n(density, kBlock, 1.0);
  std::fill_n(log_det, kBlock, 0.0);
  for (std::size_t c = m_couplings.size(); c-- > 0;) {
    const Coupling& coupling = m_couplings[c];
    condition(coupling, packed, z, rest, heads);
    for (std::size_t k = 0; k < coupling.moved.size(); ++k)
      squeeze(m_settings.bins, row(heads, static_cast<int>(k) * head_rows(m_settings.bins)), row(z, coupling.moved[k]),
              density);
    take_log(density, log_det);
  }
}

// v before each coupling and at the end, every coupling's heads and activations; then gradients of heads, v and inputs,
// weights, log q, and what ResidualNet::backward needs.
std::size_t Flow::training_scratch_count() const {
  const std::size_t dims = static_cast<std::size_t>(m_dims), couplings = m_couplings.size();
  return m_activations + m_backward_scratch +
         ((couplings + 2) * dims + (couplings + 1) * m_most_outputs + m_most_inputs + 3) * kBlock;
}

double Flow::train_block(const PackedParameters& packed, const double* y, const float* context, const float* weight,
                         const float* target, const FlowObjective& objective, float* gradients, bool accumulate,
                         float* scratch) const {
  const std::size_t dims = static_cast<std::size_t>(m_dims), couplings = m_couplings.size();
  const int bins = m_settings.bins, rows = head_rows(bins), encoded = encoded_rows(m_settings.encoding_bins);
  const auto take = [&scratch](std::size_t count) { return std::exchange(scratch, scratch + count * kBlock); };
  float* const v = take((couplings + 1) * dims);
  float* const d_v = take(dims);
  float* const heads = take(couplings * m_most_outputs);
  float* const d_heads = take(m_most_outputs);
  float* const d_x = take(m_most_inputs);
  float* const sample_weight = take(1);
  double* const log_q = reinterpret_cast<double*>(take(2));
  float* const activations = scratch;
  float* const rest = activations + m_activations;

  // y -> z, keeping everything. v + c dims: the numbers above coupling c, v itself: those of z.
  float* now = row(v, couplings * dims);
  std::fill_n(log_q, kBlock, 0.0);
  for (std::size_t i = 0; i < dims; ++i) narrow(row(y, i), row(now, i));
  for (std::size_t c = couplings; c-- > 0; now -= dims * kBlock) {
    const Coupling& coupling = m_couplings[c];
    float* const h = row(heads, c * m_most_outputs);
    float* const next = now - dims * kBlock;
    float* const x = activations + coupling.activations;
    put_context(context, x);
    encode_kept(coupling, now, x);
    coupling.net.forward(packed.forward.data() + coupling.packed, x, h);
    std::copy_n(now, dims * kBlock, next);
    for (std::size_t k = 0; k < coupling.moved.size(); ++k)
      squeeze_for_training(bins, row(h, static_cast<int>(k) * rows), row(now, coupling.moved[k]),
                           row(next, coupling.moved[k]), log_q);
  }

  const double loss = block_loss(objective, log_q, weight, target, sample_weight);
  std::fill_n(d_v, dims * kBlock, 0.0f);
  now = row(v, dims);
  for (std::size_t c = 0; c < couplings; ++c, now += dims * kBlock) {
    const Coupling& coupling = m_couplings[c];
    const float* const h = row(heads, c * m_most_outputs);
    for (std::size_t k = 0; k < coupling.moved.size(); ++k)
      squeeze_backward(bins, row(h, static_cast<int>(k) * rows), row(now, coupling.moved[k]), sample_weight,
                       row(d_v, coupling.moved[k]), row(d_heads, static_cast<int>(k) * rows));
    coupling.net.backward(packed.back.data() + coupling.packed_back, activations + coupling.activations, d_heads,
                          gradients + coupling.parameters, accumulate, coupling.sees_moved ? d_x : nullptr, false,
                          rest);
    for (std::size_t k = 0; coupling.sees_moved && k < coupling.kept.size(); ++k)
      encode_backward(m_settings.encoding_bins, row(now, coupling.kept[k]),
                      row(d_x, m_context_rows + static_cast<int>(k) * encoded), row(d_v, coupling.kept[k]));
  }
  return loss;
}

}  // namespace warpath::spline
