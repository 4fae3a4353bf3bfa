#include "warp/kdtree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "warp/load.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::size_t kLanes = 8;  // that descend together, so that their cache misses overlap
constexpr std::size_t kMaxNodes = std::size_t{1} << 27;

/// The largest float that is not above x >= 0: x < split and round_down(x) < split are the same for every float split.
float round_down(double x) {
  const float rounded = static_cast<float>(x);
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(rounded) - (rounded > x ? 1u : 0u));
}

/// Boxes of all nodes, top-down: 4 x D floats for each, z_low, z_high, y_low, y_high.
std::vector<float> boxes_of(std::size_t dims, const KdTree::Nodes& nodes) {
  const std::size_t size = 4 * dims;
  std::vector<float> boxes(nodes.dim.size() * size);
  for (std::size_t d = 0; d < dims; ++d) boxes[dims + d] = boxes[3 * dims + d] = 1.0f;
  std::size_t child = 1;
  for (std::size_t i = 0; i < nodes.dim.size(); ++i) {
    if (nodes.dim[i] == KdTree::Nodes::kLeaf) continue;
    float* lower = &boxes[child * size];
    float* upper = lower + size;
    std::copy_n(&boxes[i * size], size, lower);
    std::copy_n(&boxes[i * size], size, upper);
    lower[dims + nodes.dim[i]] = upper[nodes.dim[i]] = nodes.z_split[i];
    lower[3 * dims + nodes.dim[i]] = upper[2 * dims + nodes.dim[i]] = nodes.y_split[i];
    child += 2;
  }
  return boxes;
}

}  // namespace

std::string KdTree::problem(int dims, const Nodes& nodes) {
  const std::size_t count = nodes.dim.size();
  if (dims < 1 || dims > kMaxDims) return fmt::format("{} dimensions, not 1 to {}", dims, kMaxDims);
  if (nodes.y_split.size() != count || nodes.z_split.size() != count) return "its arrays differ in length";
  if (count < 1 || count > kMaxNodes) return fmt::format("{} nodes", count);
  std::size_t inner = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 2 * inner) return fmt::format("node {} has no parent", i);
    if (nodes.dim[i] == Nodes::kLeaf) continue;
    if (nodes.dim[i] >= dims) return fmt::format("node {} is split along dimension {} of {}", i, nodes.dim[i], dims);
    ++inner;
  }
  if (count != 2 * inner + 1) return fmt::format("{} nodes do not make a tree of {} inner ones", count, inner);
  const auto d_count = static_cast<std::size_t>(dims);
  const std::vector<float> boxes = boxes_of(d_count, nodes);
  for (std::size_t i = 0; i < count; ++i) {
    if (nodes.dim[i] == Nodes::kLeaf) continue;
    const float* box = &boxes[i * 4 * d_count + nodes.dim[i]];
    if (!(box[0] < nodes.z_split[i] && nodes.z_split[i] < box[d_count]) ||
        !(box[2 * d_count] < nodes.y_split[i] && nodes.y_split[i] < box[3 * d_count]))
      return fmt::format("the split of node {} is not inside of its box", i);
  }
  return "";
}

KdTree::KdTree(int dims, Nodes nodes) : m_dims(static_cast<std::size_t>(dims)), m_nodes(std::move(nodes)) {
  if (const std::string what = problem(dims, m_nodes); !what.empty())
    throw InternalError(fmt::format("a kd-tree that cannot be: {}", what));
  const std::size_t count = m_nodes.dim.size();
  m_boxes = boxes_of(m_dims, m_nodes);
  m_z_tree.resize(count);
  m_y_tree.resize(count);
  m_log_density.resize(count);
  std::uint32_t child = 1;
  for (std::size_t i = 0; i < count; ++i) {
    if (m_nodes.dim[i] == Nodes::kLeaf) {
      m_z_tree[i] = m_y_tree[i] = {std::numeric_limits<float>::infinity(), static_cast<std::uint32_t>(i) << 5};
    } else {
      m_z_tree[i] = {m_nodes.z_split[i], child << 5 | m_nodes.dim[i]};
      m_y_tree[i] = {m_nodes.y_split[i], child << 5 | m_nodes.dim[i]};
      child += 2;
    }
    const float* box = &m_boxes[i * 4 * m_dims];
    double log_density = 0;
    for (std::size_t d = 0; d < m_dims; ++d)
      log_density += std::log((static_cast<double>(box[m_dims + d]) - box[d]) /
                              (static_cast<double>(box[3 * m_dims + d]) - box[2 * m_dims + d]));
    m_log_density[i] = log_density;
  }
}

template <class Leaf>
void KdTree::descend(const std::vector<Link>& tree, Batch<const double> x, Leaf&& at_leaf) const {
  std::array<float, kLanes * kMaxDims> rounded;
  for (std::size_t first = 0; first < x.rows(); first += kLanes) {
    const std::size_t lanes = std::min(kLanes, x.rows() - first);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const double* row = &x(first + std::min(lane, lanes - 1), 0);
      for (std::size_t d = 0; d < m_dims; ++d) rounded[lane * m_dims + d] = round_down(row[d]);
    }
    std::array<std::uint32_t, kLanes> node{};
    for (std::uint32_t moved = 1; moved != 0;) {
      moved = 0;
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const Link link = tree[node[lane]];
        const std::uint32_t above = rounded[lane * m_dims + (link.child_and_dim & 31)] >= link.split;
        const std::uint32_t next = (link.child_and_dim >> 5) + above;
        moved |= next ^ node[lane];
        node[lane] = next;
      }
    }
    for (std::size_t lane = 0; lane < lanes; ++lane) at_leaf(first + lane, node[lane]);
  }
}

void KdTree::forward(Batch<const double> z, Batch<double> y, std::span<double> log_det) const {
  descend(m_z_tree, z, [&](std::size_t i, std::uint32_t leaf) {
    const float* box = &m_boxes[leaf * 4 * m_dims];
    for (std::size_t d = 0; d < m_dims; ++d) {
      const double z_low = box[d], z_high = box[m_dims + d], y_low = box[2 * m_dims + d], y_high = box[3 * m_dims + d];
      const double last = y_high * (1 - 0x1p-53);  // the largest double below y_high: y stays in the leaf
      y(i, d) = std::min(y_low + (z(i, d) - z_low) * ((y_high - y_low) / (z_high - z_low)), last);
    }
    log_det[i] = -m_log_density[leaf];
  });
}

void KdTree::inverse(Batch<const double> y, Batch<double> z, std::span<double> log_det) const {
  descend(m_y_tree, y, [&](std::size_t i, std::uint32_t leaf) {
    const float* box = &m_boxes[leaf * 4 * m_dims];
    for (std::size_t d = 0; d < m_dims; ++d) {
      const double z_low = box[d], z_high = box[m_dims + d], y_low = box[2 * m_dims + d], y_high = box[3 * m_dims + d];
      const double last = z_high * (1 - 0x1p-53);
      z(i, d) = std::min(z_low + (y(i, d) - y_low) * ((z_high - z_low) / (y_high - y_low)), last);
    }
    log_det[i] = m_log_density[leaf];
  });
}

void KdTree::log_density(Batch<const double> y, std::span<double> log_q) const {
  descend(m_y_tree, y, [&](std::size_t i, std::uint32_t leaf) { log_q[i] = m_log_density[leaf]; });
}

void KdTree::save(TensorFile& file, const std::string& prefix) const {
  save_header(file, prefix, *this);
  const auto count = static_cast<std::int64_t>(m_nodes.dim.size());
  file.put<std::uint8_t>(prefix + "dim", {count}, m_nodes.dim);
  file.put<float>(prefix + "y_split", {count}, m_nodes.y_split);
  file.put<float>(prefix + "z_split", {count}, m_nodes.z_split);
}

std::shared_ptr<const KdTree> KdTree::load(const TensorFile& file, const std::string& prefix) {
  const int dims = load_dims(file, prefix);
  Nodes nodes;
  nodes.dim = file.get<std::uint8_t>(prefix + "dim").values;
  nodes.y_split = file.get<float>(prefix + "y_split").values;
  nodes.z_split = file.get<float>(prefix + "z_split").values;
  if (const std::string what = problem(dims, nodes); !what.empty()) fail_load(file, prefix, what);
  return std::make_shared<KdTree>(dims, std::move(nodes));
}

}  // namespace warpath
