#include "warp/realnvp_flow.h"

#include <algorithm>
#include <utility>

#include "core/rng.h"
#include "nn/dense.h"
#include "warp/realnvp_kernels.h"
#include "warpath/error.h"

namespace warpath::realnvp {
namespace {

using nn::kBlock;

nn::Norm norm_of(RealNvpSettings::Norm norm) {
  switch (norm) {
    case RealNvpSettings::Norm::none:
      return nn::Norm::none;
    case RealNvpSettings::Norm::actnorm:
      return nn::Norm::actnorm;
    case RealNvpSettings::Norm::batch:
      return nn::Norm::batch;
  }
  throw InternalError("unknown normalisation");
}

const float* row(const float* rows, std::size_t r) { return rows + r * kBlock; }
float* row(float* rows, std::size_t r) { return rows + r * kBlock; }
float* row(float* rows, int r) { return rows + static_cast<std::size_t>(r) * kBlock; }
const float* row(const float* rows, int r) { return rows + static_cast<std::size_t>(r) * kBlock; }

}  // namespace

Flow::Flow(int dims, const RealNvpSettings& settings) : m_dims(dims), m_settings(settings) {
  if (settings.couplings < 1) throw ConfigError(fmt::format("couplings {}: must be at least 1", settings.couplings));
  if (settings.encoding_bins < 0)
    throw ConfigError(fmt::format("bins {}: must not be negative", settings.encoding_bins));
  WARPATH_CHECK(dims >= 1);
  for (int c = 0; c < settings.couplings; ++c) {
    Coupling coupling;
    // A single dimension has nothing to be conditioned on: its networks have no inputs. Alternating masks tell even
    // from odd dimensions [DSB17], as the binary ones of two dimensions do.
    const bool binary = settings.masks == RealNvpSettings::Masks::binary;
    const std::vector<bool> moves = binary_mask(binary || dims == 1 ? dims : 2, binary ? c : c % 2);
    for (int i = 0; i < dims; ++i)
      (moves[static_cast<std::size_t>(i) % moves.size()] ? coupling.moved : coupling.kept).push_back(i);
    const int kept = static_cast<int>(coupling.kept.size()), moved = static_cast<int>(coupling.moved.size());
    for (int n = 0; n < (settings.shared ? 1 : 2); ++n) {
      nn::ResidualNet net(kept * encoded_rows(settings.encoding_bins), settings.width, settings.blocks,
                          settings.shared ? 2 * moved : moved, norm_of(settings.norm));
      coupling.parameters.push_back(std::exchange(m_parameters, m_parameters + net.parameter_count()));
      coupling.packed.push_back(std::exchange(m_packed, m_packed + net.packed_count()));
      coupling.packed_back.push_back(std::exchange(m_packed_back, m_packed_back + net.packed_back_count()));
      coupling.activations.push_back(std::exchange(m_activations, m_activations + net.activation_count()));
      m_backward_scratch = std::max(m_backward_scratch, net.scratch_count());
      coupling.nets.push_back(std::move(net));
    }
    coupling.scales = std::exchange(m_parameters, m_parameters + static_cast<std::size_t>(nn::round_up(moved, 16)));
    m_most_inputs = std::max(m_most_inputs, static_cast<std::size_t>(coupling.nets[0].inputs()));
    m_most_moved = std::max(m_most_moved, coupling.moved.size());
    m_couplings.push_back(std::move(coupling));
  }
}

std::size_t Flow::first_parameter(std::size_t c) const {
  return c < m_couplings.size() ? m_couplings[c].parameters.front() : m_parameters;
}

std::vector<ParameterView> Flow::views() const {
  std::vector<ParameterView> views;
  for (std::size_t c = 0; c < m_couplings.size(); ++c) {
    const Coupling& coupling = m_couplings[c];
    for (std::size_t n = 0; n < coupling.nets.size(); ++n)
      for (std::size_t l = 0; l < coupling.nets[n].layers().size(); ++l) {
        const nn::DenseLayer& layer = coupling.nets[n].layers()[l];
        const std::string name = fmt::format("coupling{}.{}.layer{}.", c,
                                             m_settings.shared ? "st"
                                             : n == 0          ? "s"
                                                               : "t",
                                             l);
        const std::size_t at = coupling.parameters[n];
        const std::size_t rows = static_cast<std::size_t>(layer.outputs), cols = static_cast<std::size_t>(layer.inputs);
        views.push_back({name + "weight", at + layer.weight, rows, cols,
                         static_cast<std::size_t>(nn::padded_inputs(layer.inputs))});
        views.push_back({name + "bias", at + layer.bias, rows, 1, 1});
        if (!layer.normalised) continue;
        views.push_back({name + "gain", at + layer.gain, rows, 1, 1});
        if (m_settings.norm != RealNvpSettings::Norm::batch) continue;
        views.push_back({name + "mean", at + layer.mean, rows, 1, 1});
        views.push_back({name + "variance", at + layer.variance, rows, 1, 1});
      }
    views.push_back({fmt::format("coupling{}.scale", c), coupling.scales, coupling.moved.size(), 1, 1});
  }
  return views;
}

std::size_t Flow::multiply_adds() const {
  std::size_t sum = 0;
  for (const Coupling& coupling : m_couplings)
    for (const nn::ResidualNet& net : coupling.nets) sum += net.multiply_adds();
  return sum;
}

nn::AlignedVector<float> Flow::initial(std::uint64_t seed) const {
  nn::AlignedVector<float> parameters(m_parameters, 0.0f);
  std::uint64_t id = 0;
  for (const Coupling& coupling : m_couplings)
    for (std::size_t n = 0; n < coupling.nets.size(); ++n) {
      const nn::ResidualNet& net = coupling.nets[n];
      float* at = parameters.data() + coupling.parameters[n];
      net.initialise(at, sample_key(seed, id++), 1.0f);
      const nn::DenseLayer& last = net.layers().back();
      const int first_t = m_settings.shared ? net.outputs() / 2 : n == 0 ? net.outputs() : 0;
      const int stride = nn::padded_inputs(last.inputs);
      std::fill(at + last.weight + first_t * stride, at + last.weight + net.outputs() * stride, 0.0f);
    }
  return parameters;
}

void Flow::resize(PackedParameters& packed, bool back) const {
  packed.forward.resize(m_packed);
  packed.back.resize(back ? m_packed_back : 0);
  packed.scales.resize(m_parameters == 0 ? 0 : m_couplings.size() * m_most_moved);
}

void Flow::pack_coupling(std::size_t c, const float* parameters, PackedParameters& packed) const {
  const Coupling& coupling = m_couplings[c];
  for (std::size_t n = 0; n < coupling.nets.size(); ++n) {
    const float* at = parameters + coupling.parameters[n];
    float* forward = packed.forward.data() + coupling.packed[n];
    if (packed.back.empty()) {
      coupling.nets[n].pack(at, forward);
    } else {
      coupling.nets[n].pack_for_training(at, forward, packed.back.data() + coupling.packed_back[n]);
    }
  }
  std::copy_n(parameters + coupling.scales, coupling.moved.size(), packed.scales.data() + c * m_most_moved);
}

void Flow::unfold(std::size_t c, const float* parameters, float* gradients) const {
  const Coupling& coupling = m_couplings[c];
  for (std::size_t n = 0; n < coupling.nets.size(); ++n)
    coupling.nets[n].unfold(parameters + coupling.parameters[n], gradients + coupling.parameters[n]);
}

// Inference: v at the start, v now, inputs, heads, and what ResidualNet::infer needs.
std::size_t Flow::scratch_count() const {
  const std::size_t dims = static_cast<std::size_t>(m_dims), width = static_cast<std::size_t>(m_settings.width);
  return (2 * dims + m_most_inputs + 2 * m_most_moved + 2 * width) * kBlock;
}

void Flow::encode_kept(const Coupling& coupling, const float* v, float* x) const {
  for (std::size_t k = 0; k < coupling.kept.size(); ++k)
    encode(m_settings.encoding_bins, row(v, coupling.kept[k]),
           row(x, static_cast<int>(k) * encoded_rows(m_settings.encoding_bins)));
}

void Flow::encode_kept_backward(const Coupling& coupling, const float* v, const float* d_x, float* d_v) const {
  for (std::size_t k = 0; k < coupling.kept.size(); ++k)
    encode_backward(m_settings.encoding_bins, row(v, coupling.kept[k]),
                    row(d_x, static_cast<int>(k) * encoded_rows(m_settings.encoding_bins)), row(d_v, coupling.kept[k]));
}

void Flow::condition(const Coupling& coupling, const PackedParameters& packed, const float* v, float* x, float* scratch,
                     float* heads) const {
  encode_kept(coupling, v, x);
  for (std::size_t n = 0; n < coupling.nets.size(); ++n) {
    coupling.nets[n].infer(packed.forward.data() + coupling.packed[n], x, scratch, heads);
    heads += coupling.nets[n].outputs() * kBlock;
  }
}

void Flow::forward(const PackedParameters& packed, const double* z, double* y, double* log_det, float* scratch) const {
  float* start = scratch;
  float* v = row(start, m_dims);
  float* x = row(v, m_dims);
  float* heads = row(x, m_most_inputs);
  float* rest = row(heads, 2 * m_most_moved);
  logit(m_dims, z, start);
  std::copy_n(start, m_dims * kBlock, v);
  std::fill_n(log_det, kBlock, 0.0);
  for (std::size_t c = 0; c < m_couplings.size(); ++c) {
    const Coupling& coupling = m_couplings[c];
    condition(coupling, packed, v, x, rest, heads);
    couple(coupling.moved, &packed.scales[c * m_most_moved], heads, v, log_det);
  }
  shift_logit(m_dims, z, start, v, y, log_det);
}

void Flow::inverse(const PackedParameters& packed, const double* y, double* z, double* log_det, float* scratch) const {
  float* start = scratch;
  float* v = row(start, m_dims);
  float* x = row(v, m_dims);
  float* heads = row(x, m_most_inputs);
  float* rest = row(heads, 2 * m_most_moved);
  logit(m_dims, y, start);
  std::copy_n(start, m_dims * kBlock, v);
  std::fill_n(log_det, kBlock, 0.0);
  for (std::size_t c = m_couplings.size(); c-- > 0;) {
    const Coupling& coupling = m_couplings[c];
    condition(coupling, packed, v, x, rest, heads);
    uncouple(coupling.moved, &packed.scales[c * m_most_moved], heads, v, log_det);
  }
  shift_logit(m_dims, y, start, v, z, log_det);
}

// Training: v before each coupling and at the end, every coupling's heads and activations; then gradients of heads, v
// and inputs, weights, log q, and what ResidualNet::backward needs.
std::size_t Flow::training_scratch_count() const {
  const std::size_t dims = static_cast<std::size_t>(m_dims), couplings = m_couplings.size();
  return m_activations + m_backward_scratch +
         ((couplings + 2) * dims + (couplings + 1) * 2 * m_most_moved + m_most_inputs + 3) * kBlock;
}

double Flow::train_block(const PackedParameters& packed, const double* y, const float* /*context*/, const float* weight,
                         const float* target, const FlowObjective& objective, float* gradients, bool accumulate,
                         float* scratch) const {
  const std::size_t dims = static_cast<std::size_t>(m_dims), couplings = m_couplings.size();
  const auto take = [&scratch](std::size_t rows) { return std::exchange(scratch, scratch + rows * kBlock); };
  float* const v = take((couplings + 1) * dims);
  float* const d_v = take(dims);
  float* const heads = take(couplings * 2 * m_most_moved);
  float* const d_heads = take(2 * m_most_moved);
  float* const d_x = take(m_most_inputs);
  float* const sample_weight = take(1);
  double* const log_q = reinterpret_cast<double*>(take(2));
  float* const activations = scratch;
  float* const rest = activations + m_activations;

  // y -> z, keeping everything. v + c dims: the numbers above coupling c, v itself: those of z.
  float* now = v + couplings * dims * kBlock;
  std::fill_n(log_q, kBlock, 0.0);
  logit(m_dims, y, now);
  add_log_logistic(m_dims, now, true, log_q);
  for (std::size_t c = couplings; c-- > 0; now -= dims * kBlock) {
    const Coupling& coupling = m_couplings[c];
    const std::size_t moved = coupling.moved.size();
    float* h = heads + c * 2 * m_most_moved * kBlock;
    float* next = now - dims * kBlock;
    float* const x = activations + coupling.activations[0];
    encode_kept(coupling, now, x);
    for (std::size_t n = 1; n < coupling.nets.size(); ++n)
      std::copy_n(x, coupling.nets[0].inputs() * kBlock, activations + coupling.activations[n]);
    for (std::size_t n = 0; n < coupling.nets.size(); ++n)
      coupling.nets[n].forward(packed.forward.data() + coupling.packed[n], activations + coupling.activations[n],
                               row(h, n * moved));
    std::copy_n(now, dims * kBlock, next);
    uncouple(coupling.moved, &packed.scales[c * m_most_moved], h, next, log_q);
  }
  add_log_logistic(m_dims, v, false, log_q);

  const double loss = block_loss(objective, log_q, weight, target, sample_weight);
  log_logistic_gradient(m_dims, sample_weight, v, d_v);
  now = v + dims * kBlock;
  for (std::size_t c = 0; c < couplings; ++c, now += dims * kBlock) {
    const Coupling& coupling = m_couplings[c];
    const std::size_t moved = coupling.moved.size();
    const float* h = heads + c * 2 * m_most_moved * kBlock;
    for (std::size_t k = 0; k < moved; ++k) {
      const std::size_t i = static_cast<std::size_t>(coupling.moved[k]);
      const float d_scale =
          uncouple_backward(packed.scales[c * m_most_moved + k], row(h, k), row(h, moved + k), sample_weight,
                            row(now, i), row(d_v, i), row(d_heads, k), row(d_heads, moved + k));
      float& sum = gradients[coupling.scales + k];
      sum = accumulate ? sum + d_scale : d_scale;
    }
    for (std::size_t n = 0; n < coupling.nets.size(); ++n)
      coupling.nets[n].backward(packed.back.data() + coupling.packed_back[n], activations + coupling.activations[n],
                                row(d_heads, n * moved), gradients + coupling.parameters[n], accumulate, d_x, n > 0,
                                rest);
    encode_kept_backward(coupling, now, d_x, d_v);
  }
  return loss;
}

}  // namespace warpath::realnvp
