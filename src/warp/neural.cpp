#include "warp/neural.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "core/tensor_file.h"
#include "nn/dense.h"
#include "warp/flow_file.h"
#include "warp/load.h"
#include "warp/scratch.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using nn::kBlock;
constexpr std::size_t kPlaceSize = 1 + kNodeFeatures;
constexpr std::uint32_t kPanels = kNodeFeatures / 16;  // of transposed features

/// What is drawn at a vertex, found again from its place.
struct Place {
  alignas(64) std::array<float, kNodeFeatures> features;
  std::uint32_t cell;
  explicit Place(const std::uint32_t* words) : cell(words[0]) {
    std::memcpy(features.data(), words + 1, sizeof features);
  }
};

}  // namespace

Neural::Neural(std::shared_ptr<const Field> field, std::shared_ptr<const VertexNetwork> network, const VertexBox& box,
               nn::AlignedVector<float> parameters, Layout numbers)
    : m_field(std::move(field)),
      m_network(std::move(network)),
      m_box(box),
      m_parameters(std::move(parameters)),
      m_packed(m_network->trunk().packed_count()),
      m_numbers(std::move(numbers)) {
  WARPATH_CHECK_EQ(m_parameters.size(), m_network->parameter_count());
  m_network->trunk().pack(m_parameters.data(), m_packed.data());
}

void Neural::locate(const VertexContext& context, std::size_t n, std::uint32_t* places) const {
  const nn::ResidualNet& trunk = m_network->trunk();
  const auto rows = [](int count) { return static_cast<std::size_t>(count * kBlock); };
  static thread_local nn::AlignedVector<float> scratch;
  scratch.resize(rows(trunk.inputs() + 2 * trunk.width() + 2 * kNodeFeatures));
  float *x = scratch.data(), *hidden = x + rows(trunk.inputs()), *h = hidden + rows(2 * trunk.width()),
        *transposed = h + rows(kNodeFeatures);
  const Scratch<std::uint32_t> cells(n);
  m_field->locate(context, n, cells.data());
  std::array<std::uint32_t, kBlock> vertices;
  for (std::size_t first = 0; first < n; first += kBlock) {
    const std::size_t count = std::min<std::size_t>(kBlock, n - first);
    std::iota(vertices.begin(), vertices.end(), static_cast<std::uint32_t>(first));
    encode_vertices(m_box, m_network->shape().position_bins, context, std::span(vertices).first(count), x);
    trunk.infer(m_packed.data(), x, hidden, h);
    nn::transpose(kNodeFeatures, h, transposed);
    for (std::size_t s = 0; s < count; ++s) {
      std::uint32_t* place = places + (first + s) * kPlaceSize;
      *place++ = cells[first + s];
      for (std::size_t panel = 0; panel < kPanels; ++panel, place += 16)
        std::memcpy(place, transposed + (panel * kBlock + s) * 16, 16 * sizeof(float));
    }
  }
}

void Neural::sample(VertexNumbers which, const VertexContext& context, const std::uint32_t* places, std::size_t n,
                    const std::array<const double*, 3>& z, const std::array<float*, 3>& y, float* inv_q) const {
  alignas(64) std::array<std::array<float, kNodeFeatures>, kMostDraws> features;
  std::array<NodeDraw, kMostDraws> draws;
  for (std::size_t first = 0; first < n; first += kMostDraws) {
    const std::size_t count = std::min(n - first, kMostDraws);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = first + k;
      const std::uint32_t* place = places + i * kPlaceSize;
      std::memcpy(features[k].data(), place + 1, sizeof features[k]);
      const std::size_t head = VertexNetwork::head_of(which, static_cast<SurfaceKind>(context.kind[i]));
      draws[k] = {&m_network->tree(head),
                  m_parameters.data() + m_network->first_of_head(head),
                  m_field->density(which, place[0]),
                  features[k].data(),
                  {z[0][i], z[1][i], z[2][i]},
                  {},
                  0};
    }
    sample_nodes(std::span(draws).first(count));
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t a = 0; a < 3; ++a) y[a][first + k] = draws[k].y[a];
      inv_q[first + k] = draws[k].inv_q;
    }
  }
}

void Neural::inverse_density(VertexNumbers which, const VertexContext& context, const std::uint32_t* places,
                             std::size_t n, const std::array<const float*, 3>& y, float* inv_q) const {
  for (std::size_t i = 0; i < n; ++i) {
    const Place place(places + i * kPlaceSize);
    const std::size_t head = VertexNetwork::head_of(which, static_cast<SurfaceKind>(context.kind[i]));
    const NodeTree& tree = m_network->tree(head);
    inv_q[i] = inverse_node_density(tree, m_parameters.data() + m_network->first_of_head(head),
                                    m_field->density(which, place.cell), place.features.data(),
                                    tree.grid().bin(y[0][i], y[1][i], y[2][i]));
  }
}

bool Neural::expect_return(const std::uint32_t* places, std::size_t n, const float* inv_q, float* expected) const {
  const Scratch<std::uint32_t> cells(n);
  for (std::size_t i = 0; i < n; ++i) cells[i] = places[i * kPlaceSize];
  return m_field->expect_return(cells.data(), n, inv_q, expected);
}

void Neural::save(TensorFile& file, const std::string& prefix) const {
  m_field->save(file, prefix + "field.");
  auto& meta = file.metadata();
  const NeuralShape& shape = m_network->shape();
  meta[prefix + "family"] = family();
  meta[prefix + "width"] = std::to_string(shape.width);
  meta[prefix + "blocks"] = std::to_string(shape.blocks);
  meta[prefix + "position_bins"] = std::to_string(shape.position_bins);
  meta[prefix + "numbers"] = m_numbers.name();
  const std::array<float, 4> box{m_box.low[0], m_box.low[1], m_box.low[2], m_box.scale};
  file.put<float>(prefix + "box", {4}, box);
  // Padding included, as the kernels have them.
  file.put<float>(prefix + "network", {static_cast<std::int64_t>(m_parameters.size())}, m_parameters);
}

std::shared_ptr<const Neural> Neural::load(const TensorFile& file, const std::string& prefix) {
  auto field = Field::load(file, prefix + "field.");
  NeuralShape shape;
  shape.width = load_int(file, prefix, "width", 16, 1024);
  shape.blocks = load_int(file, prefix, "blocks", 0, 16);
  shape.position_bins = load_int(file, prefix, "position_bins", 0, 256);
  if (shape.width % 16 != 0) fail_load(file, prefix, fmt::format("width {}: not a multiple of 16", shape.width));
  auto network = std::make_shared<const VertexNetwork>(field->grids().light_parts, shape);
  Layout numbers = load_vertex_numbers(file, prefix);
  const std::vector<float> box = file.get<float>(prefix + "box").values;
  const std::vector<float> stored = file.get<float>(prefix + "network").values;
  if (box.size() != 4 || stored.size() != network->parameter_count())
    fail_load(file, prefix, "its network is of another size");
  const auto finite = [](float p) { return std::isfinite(p); };
  if (!std::all_of(stored.begin(), stored.end(), finite) || !std::all_of(box.begin(), box.end(), finite))
    fail_load(file, prefix, "its weights are not all finite");
  return std::make_shared<Neural>(std::move(field), std::move(network), VertexBox{{box[0], box[1], box[2]}, box[3]},
                                  nn::AlignedVector<float>(stored.begin(), stored.end()), std::move(numbers));
}

}  // namespace warpath
