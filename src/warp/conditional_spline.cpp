#include "warp/conditional_spline.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/rng.h"
#include "core/tensor_file.h"
#include "warp/flow_file.h"
#include "warp/load.h"
#include "warp/scratch.h"
#include "warp/spline_kernels.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using nn::kBlock;
constexpr int kNumbers = 3;  // of a vertex that are drawn as one

}  // namespace

ConditionalSpline::Shape::Shape(const SplineSettings& settings, int position, int film)
    : flow(kNumbers, settings, encoded_vertex_rows(position) + 2 * spline::encoded_rows(film)),
      position_bins(position),
      film_bins(film) {}

void ConditionalSpline::Shape::encode(const VertexBox& box, const VertexContext& context,
                                      std::span<const std::uint32_t> vertices, float* x) const {
  encode_vertices(box, position_bins, context, vertices, x);
  x += encoded_vertex_rows(position_bins) * kBlock;
  alignas(64) std::array<float, kBlock> place{};
  for (const float* coordinate : context.film) {
    for (std::size_t s = 0; s < vertices.size(); ++s) place[s] = coordinate[vertices[s]];
    spline::encode(film_bins, place.data(), x);
    x += spline::encoded_rows(film_bins) * kBlock;
  }
}

ConditionalSpline::ConditionalSpline(std::shared_ptr<const Shape> shape, const VertexBox& box,
                                     std::array<nn::AlignedVector<float>, 2> parameters, double uniform, Layout numbers)
    : m_shape(std::move(shape)),
      m_box(box),
      m_parameters(std::move(parameters)),
      m_uniform(static_cast<double>(static_cast<float>(uniform))),
      m_numbers(std::move(numbers)) {
  WARPATH_CHECK(uniform >= 0 && uniform < 1);
  for (std::size_t w = 0; w < m_packed.size(); ++w) {
    WARPATH_CHECK_EQ(m_parameters[w].size(), m_shape->flow.parameter_count());
    m_shape->flow.pack(m_parameters[w].data(), m_packed[w], false);
  }
}

/// Some vertices on their way through a flow.
class ConditionalSpline::Block {
 public:
  Block(const ConditionalSpline& warp, VertexDecision which)
      : m_warp(warp), m_packed(warp.m_packed[static_cast<std::size_t>(which)]) {
    const spline::Flow& flow = warp.m_shape->flow;
    const auto floats = static_cast<std::size_t>(flow.context_rows()) * kBlock;
    static thread_local nn::AlignedVector<float> memory;  // a thread has one block at a time
    memory.resize(floats + flow.scratch_count());
    m_context = memory.data();
    m_scratch = m_context + floats;
  }
  /// Starts with up to kBlock vertices; v: what is to be filled in for each, kNumbers rows.
  void start(const VertexContext& context, std::span<const std::uint32_t> vertices) {
    m_warp.m_shape->encode(m_warp.m_box, context, vertices, m_context);
    std::fill(v.begin(), v.end(), 0.5);
  }
  void forward() {
    m_warp.m_shape->flow.forward(m_packed, v.data(), m_context, v.data(), log_q.data(), m_scratch);
    for (double& l : log_q) l = -l;
  }
  /// v is left as it is.
  void inverse() { m_warp.m_shape->flow.inverse(m_packed, v.data(), m_context, m_z.data(), log_q.data(), m_scratch); }

  alignas(64) std::array<double, kNumbers * kBlock> v;
  alignas(64) std::array<double, kBlock> log_q;

 private:
  const ConditionalSpline& m_warp;
  const PackedParameters& m_packed;
  alignas(64) std::array<double, kNumbers * kBlock> m_z;
  float *m_context, *m_scratch;
};

float ConditionalSpline::inverse_of(double log_q) const {
  return static_cast<float>(1 / ((1 - m_uniform) * std::exp(std::min(log_q, 80.0)) + m_uniform));
}

void ConditionalSpline::sample(VertexDecision which, const VertexContext& context, const std::uint32_t*, std::size_t n,
                               const std::array<const double*, 3>& z, const std::array<float*, 3>& y,
                               float* inv_q) const {
  // First those that the uniform share draws, whose density the flow tells; then those that go through it.
  const Scratch<std::uint32_t> order(n);
  std::iota(order.data(), order.data() + n, 0u);
  const auto is_uniform = [&](std::uint32_t i) { return z[0][i] < m_uniform; };
  const auto uniform =
      static_cast<std::size_t>(std::stable_partition(order.data(), order.data() + n, is_uniform) - order.data());
  const auto part = [&](std::size_t begin, std::size_t end, double from, double to, bool through) {
    Block block(*this, which);
    for (std::size_t first = begin; first < end; first += kBlock) {
      const std::span<const std::uint32_t> vertices(order.data() + first, std::min<std::size_t>(kBlock, end - first));
      block.start(context, vertices);
      for (std::size_t s = 0; s < vertices.size(); ++s) {
        const std::uint32_t i = vertices[s];
        const double z0 = std::min((z[0][i] - from) / (to - from), 1 - 0x1p-53);  // uniform again
        for (std::size_t a = 0; a < kNumbers; ++a) {
          const double latent = a == 0 ? z0 : z[a][i];
          block.v[a * kBlock + s] = through ? latent : static_cast<double>(to_primary(latent));
        }
      }
      if (through)
        block.forward();
      else
        block.inverse();
      for (std::size_t s = 0; s < vertices.size(); ++s) {
        const std::uint32_t i = vertices[s];
        for (std::size_t a = 0; a < kNumbers; ++a) y[a][i] = to_primary(block.v[a * kBlock + s]);
        inv_q[i] = inverse_of(block.log_q[s]);
      }
    }
  };
  part(0, uniform, 0, m_uniform, false);
  part(uniform, n, m_uniform, 1, true);
}

void ConditionalSpline::inverse_density(VertexDecision which, const VertexContext& context, const std::uint32_t*,
                                        std::size_t n, const std::array<const float*, 3>& y, float* inv_q) const {
  Block block(*this, which);
  std::array<std::uint32_t, kBlock> indices;
  for (std::size_t first = 0; first < n; first += kBlock) {
    const std::size_t count = std::min<std::size_t>(kBlock, n - first);
    std::iota(indices.begin(), indices.end(), static_cast<std::uint32_t>(first));
    block.start(context, std::span(indices).first(count));
    for (std::size_t a = 0; a < kNumbers; ++a)
      for (std::size_t s = 0; s < count; ++s) block.v[a * kBlock + s] = static_cast<double>(y[a][first + s]);
    block.inverse();
    for (std::size_t s = 0; s < count; ++s) inv_q[first + s] = inverse_of(block.log_q[s]);
  }
}

void ConditionalSpline::save(TensorFile& file, const std::string& prefix) const {
  auto& meta = file.metadata();
  meta[prefix + "family"] = family();
  meta[prefix + "numbers"] = m_numbers.name();
  meta[prefix + "position_bins"] = std::to_string(m_shape->position_bins);
  meta[prefix + "film_bins"] = std::to_string(m_shape->film_bins);
  save_settings(file, prefix, m_shape->flow.settings());
  const std::array<float, 5> place{m_box.low[0], m_box.low[1], m_box.low[2], m_box.scale,
                                   static_cast<float>(m_uniform)};
  file.put<float>(prefix + "box_and_uniform", {5}, place);
  save_parameters(file, prefix + "light.", m_shape->flow, m_parameters[0]);
  save_parameters(file, prefix + "scatter.", m_shape->flow, m_parameters[1]);
}

std::shared_ptr<const ConditionalSpline> ConditionalSpline::load(const TensorFile& file, const std::string& prefix) {
  const int position_bins = load_int(file, prefix, "position_bins", 0, 256);
  const int film_bins = load_int(file, prefix, "film_bins", 0, 256);
  auto shape = std::make_shared<const Shape>(load_spline_settings(file, prefix), position_bins, film_bins);
  Layout numbers = load_decisions(file, prefix);
  const std::vector<float> place = file.get<float>(prefix + "box_and_uniform").values;
  const auto finite = [](float p) { return std::isfinite(p); };
  if (place.size() != 5 || !std::all_of(place.begin(), place.end(), finite) || !(place[4] >= 0 && place[4] < 1))
    fail_load(file, prefix, "its box and share of uniform numbers are not what they should be");
  return std::make_shared<ConditionalSpline>(shape, VertexBox{{place[0], place[1], place[2]}, place[3]},
                                             std::array{load_parameters(file, prefix + "light.", shape->flow),
                                                        load_parameters(file, prefix + "scatter.", shape->flow)},
                                             static_cast<double>(place[4]), std::move(numbers));
}

}  // namespace warpath
