#include "warp/field_tree.h"

#include <algorithm>
#include <cmath>

namespace warpath {

std::uint32_t FieldTree::root_key(const VertexContext& context, std::size_t i) {
  const std::array<float, 3> n{context.normal[0][i], context.normal[1][i], context.normal[2][i]};
  std::uint32_t axis = 0;
  for (std::uint32_t a = 1; a < 3; ++a)
    if (std::fabs(n[a]) > std::fabs(n[axis])) axis = a;
  const std::uint32_t side = 2 * axis + (n[axis] < 0);
  return (context.material[i] * kSides + side) * kKinds + context.kind[i];
}

FieldTree::Features FieldTree::features(const VertexContext& context, std::size_t i) {
  return {context.position[0][i], context.position[1][i], context.position[2][i],
          context.wi[0][i],       context.wi[1][i],       context.wi[2][i]};
}

void FieldTree::find_cells(const VertexContext& context, std::size_t n, std::uint32_t* cells) const {
  constexpr std::size_t kBlock = 16;
  std::array<Features, kBlock> at;
  std::array<std::uint32_t, kBlock> node, open;  // open: those that are not at a leaf yet
  for (std::size_t first = 0; first < n; first += kBlock) {
    const std::size_t count = std::min(n - first, kBlock);
    std::size_t left = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t key = root_key(context, first + k);
      at[k] = features(context, first + k);
      node[k] = key < m_roots.size() ? m_roots[key] : kNoCell;
      cells[first + k] = kNoCell;
      if (node[k] != kNoCell) open[left++] = static_cast<std::uint32_t>(k);
    }
    while (left > 0) {
      std::size_t kept = 0;
      for (std::size_t o = 0; o < left; ++o) {
        const std::uint32_t k = open[o];
        const Node& here = m_nodes[node[k]];
        if (here.feature == kLeaf) {
          cells[first + k] = here.next;
          continue;
        }
        node[k] = here.next + (at[k][here.feature] >= here.split);
        open[kept++] = k;
      }
      left = kept;
    }
  }
}

std::uint32_t FieldTree::add_root(std::uint32_t root_key) {
  if (root_key >= m_roots.size()) m_roots.resize(root_key + 1, kNoCell);
  const auto node = static_cast<std::uint32_t>(m_nodes.size());
  m_roots[root_key] = node;
  m_nodes.push_back({0, kLeaf, m_cells});
  m_leaf_of.push_back(node);
  return m_cells++;
}

std::uint32_t FieldTree::split(std::uint32_t cell, std::size_t feature, float at) {
  const std::uint32_t node = m_leaf_of[cell], children = static_cast<std::uint32_t>(m_nodes.size());
  m_nodes[node] = {at, static_cast<std::uint32_t>(feature), children};
  m_nodes.push_back({0, kLeaf, cell});
  m_nodes.push_back({0, kLeaf, m_cells});
  m_leaf_of[cell] = children;
  m_leaf_of.push_back(children + 1);
  return m_cells++;
}

FieldTree::Flat FieldTree::flat() const {
  Flat flat;
  flat.roots.assign(m_roots.begin(), m_roots.end());
  for (const Node& node : m_nodes) {
    flat.nodes.push_back(static_cast<std::int32_t>(node.feature));
    flat.nodes.push_back(static_cast<std::int32_t>(node.next));
    flat.splits.push_back(node.split);
  }
  return flat;
}

bool FieldTree::from_flat(const Flat& flat, FieldTree& tree) {
  tree = {};
  const auto count = static_cast<std::uint32_t>(flat.splits.size());
  if (flat.nodes.size() != 2 * flat.splits.size()) return false;
  std::vector<std::uint32_t> parents(count, 0);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto feature = static_cast<std::uint32_t>(flat.nodes[2 * i]);
    const auto next = static_cast<std::uint32_t>(flat.nodes[2 * i + 1]);
    tree.m_nodes.push_back({flat.splits[i], feature, next});
    if (feature == kLeaf) {
      if (next >= count) return false;
      if (next >= tree.m_leaf_of.size()) tree.m_leaf_of.resize(next + 1, kNoCell);
      if (tree.m_leaf_of[next] != kNoCell) return false;
      tree.m_leaf_of[next] = i;
      ++tree.m_cells;
    } else {
      // Children stand behind their parent, so there is no way round in circles.
      if (feature >= kFeatures || next <= i || next + 1 >= count || !std::isfinite(flat.splits[i])) return false;
      ++parents[next], ++parents[next + 1];
    }
  }
  for (const std::int32_t root : flat.roots) {
    tree.m_roots.push_back(static_cast<std::uint32_t>(root));
    if (tree.m_roots.back() == kNoCell) continue;
    if (tree.m_roots.back() >= count) return false;
    ++parents[tree.m_roots.back()];
  }
  for (const std::uint32_t n : parents)
    if (n != 1) return false;
  return tree.m_cells == tree.m_leaf_of.size();
}

}  // namespace warpath
