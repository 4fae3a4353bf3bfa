#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "path/primary_source.h"

namespace warpath {

/// Where vertices are alike: a binary tree over position and incoming direction for each kind of surface, material and
/// side of the world that the normal looks to. Its leaves are cells, numbered from 0.
class FieldTree {
 public:
  static constexpr std::uint32_t kNoCell = 0xffffffffu;
  /// What a tree splits by: position, then the direction towards the previous vertex.
  static constexpr std::size_t kFeatures = 6;
  using Features = std::array<float, kFeatures>;

  /// Which tree vertex i belongs to.
  static std::uint32_t root_key(const VertexContext& context, std::size_t i);
  static SurfaceKind kind_of(std::uint32_t root_key) { return static_cast<SurfaceKind>(root_key % kKinds); }
  static Features features(const VertexContext& context, std::size_t i);

  /// The cell of a vertex; kNoCell if nothing like it was seen.
  std::uint32_t cell(std::uint32_t root_key, const Features& at) const {
    if (root_key >= m_roots.size() || m_roots[root_key] == kNoCell) return kNoCell;
    const Node* node = &m_nodes[m_roots[root_key]];
    while (node->feature != kLeaf) node = &m_nodes[node->next + (at[node->feature] >= node->split)];
    return node->next;
  }
  /// The same for n vertices, several at a time: each waits for memory while the others go on.
  void find_cells(const VertexContext& context, std::size_t n, std::uint32_t* cells) const;
  std::uint32_t cells() const { return m_cells; }

  /// A new tree of one cell, which is returned.
  std::uint32_t add_root(std::uint32_t root_key);
  /// Cuts a cell in two: what lies below `at` stays in it, the rest is in a new cell, which is returned.
  std::uint32_t split(std::uint32_t cell, std::size_t feature, float at);

  /// As numbers, to be stored.
  struct Flat {
    std::vector<std::int32_t> roots, nodes;  // nodes: feature, next
    std::vector<float> splits;
  };
  Flat flat() const;
  /// Returns false if the numbers are not a tree.
  static bool from_flat(const Flat& flat, FieldTree& tree);

 private:
  static constexpr std::uint32_t kKinds = 6, kSides = 6;
  static constexpr std::uint32_t kLeaf = 0xffffffffu;
  struct Node {
    float split;
    std::uint32_t feature;
    std::uint32_t next;  // first of two children, or the cell of a leaf
  };
  std::vector<Node> m_nodes;
  std::vector<std::uint32_t> m_roots;    // key -> node
  std::vector<std::uint32_t> m_leaf_of;  // cell -> node
  std::uint32_t m_cells = 0;
};

}  // namespace warpath
