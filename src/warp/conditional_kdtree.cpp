#include "warp/conditional_kdtree.h"

#include <algorithm>
#include <cmath>

#include "core/rng.h"
#include "core/tensor_file.h"
#include "warp/flow_file.h"
#include "warp/load.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr int kNumbers = 3;  // of a vertex that are drawn as one
constexpr std::array kBoth{VertexDecision::light_sampling, VertexDecision::scattering};
constexpr std::array<const char*, 2> kNames{"light.", "scatter."};

/// A box of numbers and the box of latents that is mapped to it.
struct Boxes {
  std::array<float, kNumbers> y_low{}, y_high{1, 1, 1}, z_low{}, z_high{1, 1, 1};
  void go_below(std::size_t d, float y_split, float z_split) { y_high[d] = y_split, z_high[d] = z_split; }
  void go_above(std::size_t d, float y_split, float z_split) { y_low[d] = y_split, z_low[d] = z_split; }
};

}  // namespace

ConditionalKdTree::ConditionalKdTree(const FilmTiling& tiling, const std::array<Trees, 2>& trees, double uniform,
                                     Layout numbers)
    : m_tiling(tiling), m_uniform(static_cast<double>(static_cast<float>(uniform))), m_numbers(std::move(numbers)) {
  WARPATH_CHECK(uniform >= 0 && uniform < 1);
  WARPATH_CHECK(tiling.tilings >= 1 && tiling.tilings <= kMostTilings);
  for (std::size_t w = 0; w < trees.size(); ++w) {
    WARPATH_CHECK_EQ(trees[w].size(), tiling.tiles());
    for (const KdTree::Nodes& tree : trees[w]) append(tree, m_trees[w]);
  }
}

void ConditionalKdTree::append(const KdTree::Nodes& tree, Flat& flat) {
  const auto first = static_cast<std::uint32_t>(flat.nodes.size());
  flat.roots.push_back(tree.dim.empty() ? kNoTree : first);
  std::vector<Boxes> boxes(tree.dim.size());
  std::uint32_t child = 1;
  for (std::size_t i = 0; i < tree.dim.size(); ++i) {
    const Boxes& box = boxes[i];
    if (tree.dim[i] == KdTree::Nodes::kLeaf) {
      double density = 1;
      for (std::size_t d = 0; d < kNumbers; ++d)
        density *= (static_cast<double>(box.z_high[d]) - static_cast<double>(box.z_low[d])) /
                   (static_cast<double>(box.y_high[d]) - static_cast<double>(box.y_low[d]));
      flat.nodes.push_back({static_cast<float>(density), 0, kLeaf});
      continue;
    }
    const std::size_t d = tree.dim[i];
    boxes[child] = boxes[child + 1] = box;
    boxes[child].go_below(d, tree.y_split[i], tree.z_split[i]);
    boxes[child + 1].go_above(d, tree.y_split[i], tree.z_split[i]);
    flat.nodes.push_back({tree.y_split[i], tree.z_split[i], (first + child) << 2 | tree.dim[i]});
    child += 2;
  }
}

void ConditionalKdTree::locate(const VertexContext& context, std::size_t n, std::uint32_t* places) const {
  for (std::size_t i = 0; i < n; ++i)
    for (int k = 0; k < m_tiling.tilings; ++k)
      *places++ = static_cast<std::uint32_t>(m_tiling.tile(k, context.film[0][i], context.film[1][i]));
}

float ConditionalKdTree::density(const Flat& flat, std::uint32_t tile, const std::array<float, 3>& y) const {
  if (flat.roots[tile] == kNoTree) return 1;
  const Node* node = &flat.nodes[flat.roots[tile]];
  for (std::uint32_t dim; (dim = node->child_and_dim & 3) != kLeaf;)
    node = &flat.nodes[(node->child_and_dim >> 2) + (y[dim] >= node->y_split)];
  return node->y_split;
}

float ConditionalKdTree::inverse_density(const Flat& flat, const std::uint32_t* tiles,
                                         const std::array<float, 3>& y) const {
  float sum = 0;
  for (int k = 0; k < m_tiling.tilings; ++k) sum += density(flat, tiles[k], y);
  const auto uniform = static_cast<float>(m_uniform);
  return 1 / (uniform + (1 - uniform) * sum / static_cast<float>(m_tiling.tilings));
}

std::array<float, 3> ConditionalKdTree::descend(const Flat& flat, std::uint32_t tile, const std::array<double, 3>& z) {
  Boxes box;
  if (flat.roots[tile] != kNoTree) {
    const Node* node = &flat.nodes[flat.roots[tile]];
    for (std::uint32_t dim; (dim = node->child_and_dim & 3) != kLeaf;) {
      const bool above = z[dim] >= static_cast<double>(node->z_split);
      if (above)
        box.go_above(dim, node->y_split, node->z_split);
      else
        box.go_below(dim, node->y_split, node->z_split);
      node = &flat.nodes[(node->child_and_dim >> 2) + above];
    }
  }
  std::array<float, 3> y;
  for (std::size_t d = 0; d < kNumbers; ++d) {
    const double y_low = box.y_low[d], z_low = box.z_low[d];
    const double stretch = (static_cast<double>(box.y_high[d]) - y_low) / (static_cast<double>(box.z_high[d]) - z_low);
    // It stays in the leaf, and below 1.
    y[d] = std::clamp(static_cast<float>(y_low + (z[d] - z_low) * stretch), box.y_low[d],
                      std::nextafter(box.y_high[d], 0.0f));
  }
  return y;
}

void ConditionalKdTree::sample(VertexDecision which, const VertexContext&, const std::uint32_t* places, std::size_t n,
                               const std::array<const double*, 3>& z, const std::array<float*, 3>& y,
                               float* inv_q) const {
  const Flat& flat = m_trees[static_cast<std::size_t>(which)];
  const double tilings = m_tiling.tilings;
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t* tiles = places + i * place_size();
    std::array<double, 3> latent{z[0][i], z[1][i], z[2][i]};
    std::array<float, 3> drawn;
    // The first latent chooses a part of the mixture, and is uniform again within it.
    if (latent[0] < m_uniform) {
      latent[0] /= m_uniform;
      for (std::size_t d = 0; d < kNumbers; ++d) drawn[d] = to_primary(latent[d]);
    } else {
      const double in_trees = std::min((latent[0] - m_uniform) / (1 - m_uniform) * tilings, tilings * (1 - 0x1p-52));
      const double k = std::floor(in_trees);
      latent[0] = in_trees - k;
      drawn = descend(flat, tiles[static_cast<std::size_t>(k)], latent);
    }
    for (std::size_t d = 0; d < kNumbers; ++d) y[d][i] = drawn[d];
    inv_q[i] = inverse_density(flat, tiles, drawn);
  }
}

void ConditionalKdTree::inverse_density(VertexDecision which, const VertexContext&, const std::uint32_t* places,
                                        std::size_t n, const std::array<const float*, 3>& y, float* inv_q) const {
  for (std::size_t i = 0; i < n; ++i)
    inv_q[i] = inverse_density(m_trees[static_cast<std::size_t>(which)], places + i * place_size(),
                               {y[0][i], y[1][i], y[2][i]});
}

void ConditionalKdTree::save(TensorFile& file, const std::string& prefix) const {
  auto& meta = file.metadata();
  meta[prefix + "family"] = family();
  meta[prefix + "numbers"] = m_numbers.name();
  meta[prefix + "columns"] = std::to_string(m_tiling.columns);
  meta[prefix + "rows"] = std::to_string(m_tiling.rows);
  meta[prefix + "tilings"] = std::to_string(m_tiling.tilings);
  const std::array<float, 1> uniform{static_cast<float>(m_uniform)};
  file.put<float>(prefix + "uniform", {1}, uniform);
  for (const VertexDecision which : kBoth) {
    const Flat& flat = m_trees[static_cast<std::size_t>(which)];
    const std::string name = prefix + kNames[static_cast<std::size_t>(which)];
    std::vector<std::int32_t> sizes;
    auto end = static_cast<std::uint32_t>(flat.nodes.size());
    for (std::size_t t = flat.roots.size(); t-- > 0;) {
      const std::uint32_t root = flat.roots[t];
      sizes.push_back(root == kNoTree ? 0 : static_cast<std::int32_t>(end - root));
      if (root != kNoTree) end = root;
    }
    std::reverse(sizes.begin(), sizes.end());
    std::vector<std::uint8_t> dims;
    std::vector<float> y_splits, z_splits;
    for (const Node& node : flat.nodes) {
      const auto dim = static_cast<std::uint8_t>(node.child_and_dim & 3);
      dims.push_back(dim == kLeaf ? KdTree::Nodes::kLeaf : dim);
      y_splits.push_back(dim == kLeaf ? 0 : node.y_split);
      z_splits.push_back(node.z_split);
    }
    const auto count = static_cast<std::int64_t>(flat.nodes.size());
    file.put<std::int32_t>(name + "sizes", {static_cast<std::int64_t>(sizes.size())}, sizes);
    file.put<std::uint8_t>(name + "dim", {count}, dims);
    file.put<float>(name + "y_split", {count}, y_splits);
    file.put<float>(name + "z_split", {count}, z_splits);
  }
}

std::shared_ptr<const ConditionalKdTree> ConditionalKdTree::load(const TensorFile& file, const std::string& prefix) {
  FilmTiling tiling;
  tiling.columns = load_int(file, prefix, "columns", 1, 1 << 12);
  tiling.rows = load_int(file, prefix, "rows", 1, 1 << 12);
  tiling.tilings = load_int(file, prefix, "tilings", 1, kMostTilings);
  Layout numbers = load_decisions(file, prefix);
  const std::vector<float> uniform = file.get<float>(prefix + "uniform").values;
  if (uniform.size() != 1 || !(uniform[0] >= 0 && uniform[0] < 1))
    fail_load(file, prefix, "its share of uniform numbers is not in [0, 1)");
  std::array<Trees, 2> trees;
  for (const VertexDecision which : kBoth) {
    const std::string name = prefix + kNames[static_cast<std::size_t>(which)];
    const auto sizes = file.get<std::int32_t>(name + "sizes").values;
    const auto dims = file.get<std::uint8_t>(name + "dim").values;
    const auto y_splits = file.get<float>(name + "y_split").values, z_splits = file.get<float>(name + "z_split").values;
    std::int64_t sum = 0;
    for (const std::int32_t size : sizes) {
      if (size < 0) fail_load(file, prefix, fmt::format("a tree of {} nodes", size));
      sum += size;
    }
    if (sizes.size() != tiling.tiles() || static_cast<std::size_t>(sum) != dims.size() ||
        y_splits.size() != dims.size() || z_splits.size() != dims.size())
      fail_load(file, prefix, "its trees are not as many, or not of such a size, as it says");
    std::ptrdiff_t at = 0;
    const auto part = [&](const auto& values, std::int32_t size) {
      return std::decay_t<decltype(values)>(values.begin() + at, values.begin() + at + size);
    };
    for (const std::int32_t size : sizes) {
      KdTree::Nodes tree{part(dims, size), part(y_splits, size), part(z_splits, size)};
      at += size;
      const std::string what = size == 0 ? "" : KdTree::problem(kNumbers, tree);
      if (!what.empty()) fail_load(file, prefix, what);
      trees[static_cast<std::size_t>(which)].push_back(std::move(tree));
    }
  }
  return std::make_shared<ConditionalKdTree>(tiling, trees, static_cast<double>(uniform[0]), std::move(numbers));
}

}  // namespace warpath
