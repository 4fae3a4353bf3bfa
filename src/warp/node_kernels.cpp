#include "warp/node_kernels.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "warpath/error.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "warp/node_kernels.cpp"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "warp/exp2-inl.h"

HWY_BEFORE_NAMESPACE();
namespace warpath::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;
constexpr D d;
constexpr hn::RebindToSigned<D> di;
constexpr int kLanes = hn::MaxLanes(D());
constexpr int kVectors = 16 / kLanes;
constexpr std::uint32_t kChildren = NodeTree::kChildren;
constexpr float kPriorShare = NodeTree::kPriorShare;
constexpr std::uint32_t kMaxDepth = 3;
static_assert(HalvingGrid::kMaxLevels == 4 * kMaxDepth);

/// A number for each of the 16 children of a node.
struct Children {
  V v[kVectors];

  static HWY_INLINE Children Load(const float* p) {
    Children c;
    for (int k = 0; k < kVectors; ++k) c.v[k] = hn::Load(d, p + k * kLanes);
    return c;
  }
  HWY_INLINE void Store(float* p) const {
    for (int k = 0; k < kVectors; ++k) hn::Store(v[k], d, p + k * kLanes);
  }
};

/// Sums up to and with each child.
HWY_INLINE Children PrefixSums(Children c) {
  const auto lane = hn::Iota(di, 0), zero = hn::Zero(di);
  const auto last = hn::IndicesFromVec(d, hn::Set(di, kLanes - 1));
  for (int k = 0; k < kVectors; ++k) {
    HWY_UNROLL(4)
    for (int step = 1; step < kLanes; step *= 2) {
      const auto from = hn::Sub(lane, hn::Set(di, step));
      const auto outside = hn::RebindMask(d, hn::Lt(from, zero));
      const V before = hn::TableLookupLanes(c.v[k], hn::IndicesFromVec(d, hn::Max(from, zero)));
      c.v[k] = hn::Add(c.v[k], hn::IfThenZeroElse(outside, before));
    }
    if (k > 0) c.v[k] = hn::Add(c.v[k], hn::TableLookupLanes(c.v[k - 1], last));
  }
  return c;
}

/// Vector k of 16 bytes.
template <class Bytes>
HWY_INLINE hn::Vec<decltype(di)> Widen(Bytes bytes, int k) {
  if constexpr (kVectors == 1) {
    return hn::PromoteTo(di, bytes);
  } else {
    const hn::Rebind<std::uint8_t, D> half;
    return hn::PromoteTo(di, k == 0 ? hn::LowerHalf(half, bytes) : hn::UpperHalf(half, bytes));
  }
}

/// The prior of a node's children, and its sums up to and with each.
struct Prior {
  Children own, reached;

  HWY_INLINE Prior(const NodeTree& tree, const CumulativeProbability* field, std::uint32_t node) {
    if (!field) {
      own = Children::Load(tree.shares() + node * kChildren);
      reached = Children::Load(tree.reached() + node * kChildren);
      return;
    }
    // In registers: a load that crosses two stores has to wait for both.
    const hn::CappedTag<std::uint8_t, 16> bytes;
    const auto ends = hn::LoadU(bytes, field + node * kChildren), begins = hn::ShiftLeftBytes<1>(ends);
    const V unit = hn::Set(d, 1.0f / kWholeProbability);
    for (int k = 0; k < kVectors; ++k) {
      const auto end = Widen(ends, k), begin = Widen(begins, k);
      own.v[k] = hn::Mul(hn::ConvertTo(d, hn::Sub(end, begin)), unit);
      reached.v[k] = hn::Mul(hn::ConvertTo(d, end), unit);
    }
  }
};

/// b + W h of a node's children.
HWY_INLINE Children Logits(const float* HWY_RESTRICT w, const float* HWY_RESTRICT h) {
  constexpr int kChains = 4;  // to hide the latency of the additions
  V sums[kChains][kVectors];
  for (int k = 0; k < kVectors; ++k) {
    sums[0][k] = hn::Load(d, w + k * kLanes);
    for (int c = 1; c < kChains; ++c) sums[c][k] = hn::Zero(d);
  }
  w += kChildren;
  HWY_UNROLL(8)
  for (int f = 0; f < kNodeFeatures; f += kChains) {
    HWY_UNROLL(4)
    for (int c = 0; c < kChains; ++c, w += kChildren) {
      const V feature = hn::Set(d, h[f + c]);
      for (int k = 0; k < kVectors; ++k) sums[c][k] = hn::MulAdd(feature, hn::Load(d, w + k * kLanes), sums[c][k]);
    }
  }
  Children logits;
  for (int k = 0; k < kVectors; ++k)
    logits.v[k] = hn::Add(hn::Add(sums[0][k], sums[1][k]), hn::Add(sums[2][k], sums[3][k]));
  return logits;
}

/// e = prior * exp(logits) of a node's children, sums up to and with each, and 1 over the whole.
struct Node {
  Children e, reached;
  float over_sum;

  HWY_INLINE Node(const Children& logits, const Prior& prior) {
    const V log2_e = hn::Set(d, std::numbers::log2e_v<float>);
    const V most = hn::Set(d, 40.0f);  // far from overflow; and no child vanishes
    for (int k = 0; k < kVectors; ++k) {
      const V octaves = hn::Max(hn::Min(hn::Mul(logits.v[k], log2_e), most), hn::Neg(most));
      e.v[k] = hn::Mul(prior.own.v[k], Exp2(d, octaves));
    }
    reached = PrefixSums(e);
    HWY_ALIGN float last[kLanes];
    hn::Store(reached.v[kVectors - 1], d, last);
    over_sum = 1 / last[kLanes - 1];
  }
};

/// The way down a tree: probabilities of the node by the network and by the prior.
struct Way {
  float network = 1, prior = 1;
  HWY_INLINE float mass() const { return (1 - kPriorShare) * network + kPriorShare * prior; }
  HWY_INLINE void Descend(float e, float over_sum, float prior_share) {
    network *= e * over_sum;
    prior *= prior_share;
  }
};

/// A draw on its way down its tree.
struct Descent {
  std::array<double, 3> z;
  std::array<std::uint32_t, 3> place{};
  Way way;
  std::uint32_t node = 0, child = 0;
};

/// Chooses the child of a node.
HWY_INLINE void Choose(const NodeDraw& draw, std::uint32_t depth, const float* HWY_RESTRICT logits, Descent& on) {
  HWY_ALIGN float e[kChildren], own[kChildren], reached[kChildren];
  const HalvingGrid::Rank& rank = draw.tree->grid().rank(depth);
  const Prior prior(*draw.tree, draw.prior, on.node);
  const Node here(Children::Load(logits), prior);
  const V network = hn::Set(d, (1 - kPriorShare) * on.way.network * here.over_sum);
  const V rest = hn::Set(d, kPriorShare * on.way.prior);
  double& z = on.z[rank.driver];
  const float key = static_cast<float>(z) * on.way.mass();
  const V keys = hn::Set(d, key);
  std::size_t passed = 0;
  for (int k = 0; k < kVectors; ++k) {
    const V end = hn::MulAdd(network, here.reached.v[k], hn::Mul(rest, prior.reached.v[k]));
    hn::Store(end, d, reached + k * kLanes);
    passed += hn::CountTrue(d, hn::Le(end, keys));
  }
  here.e.Store(e);
  prior.own.Store(own);
  auto child = static_cast<std::uint32_t>(std::min<std::size_t>(passed, kChildren - 1));
  // Rounding may lead beyond the last child that exists, and those that do are the first ones.
  while (!(own[child] > 0)) --child;
  on.child = child;
  on.way.Descend(e[child], here.over_sum, own[child]);
  const float mass = on.way.mass();
  z = std::clamp(static_cast<double>((key - (reached[child] - mass)) / mass), 0.0, 0x1.fffffep-1);
  for (std::size_t a = 0; a < 3; ++a) on.place[a] += rank.place[child][a];
}

// The logits of all draws, then all choices: one draw's chain of operations alone would leave the core waiting.
void SampleNodes(NodeDraw* HWY_RESTRICT draws, std::size_t n) {
  HWY_ALIGN float logits[kMostDraws][kChildren];
  std::array<Descent, kMostDraws> on;
  for (std::size_t i = 0; i < n; ++i) on[i].z = draws[i].z;
  const std::uint32_t depths = n > 0 ? draws[0].tree->grid().depth() : 0;
  for (std::uint32_t depth = 0; depth < depths; ++depth) {
    for (std::size_t i = 0; i < n; ++i) {
      Descent& to = on[i];
      if (depth > 0) {
        const HalvingGrid& grid = draws[i].tree->grid();
        to.node = grid.rank(depth).first + (to.node - grid.rank(depth - 1).first) * kChildren + to.child;
      }
      Logits(draws[i].weights + to.node * NodeTree::kNodeSize, draws[i].h).Store(logits[i]);
    }
    for (std::size_t i = 0; i < n; ++i) Choose(draws[i], depth, logits[i], on[i]);
  }
  for (std::size_t i = 0; i < n; ++i) {
    draws[i].y = draws[i].tree->grid().point(on[i].place, on[i].z);
    draws[i].inv_q = draws[i].tree->bin_volume() / on[i].way.mass();
  }
}

float InverseNodeDensity(const NodeTree& tree, const float* HWY_RESTRICT weights, const CumulativeProbability* field,
                         const float* HWY_RESTRICT h, std::uint32_t bin) {
  const HalvingGrid& grid = tree.grid();
  Way way;
  HWY_ALIGN float e[kChildren], own[kChildren];
  for (std::uint32_t depth = 0; depth < grid.depth(); ++depth) {
    const std::uint32_t node = grid.node_above(bin, depth), child = grid.child_above(bin, depth);
    const Prior prior(tree, field, node);
    const Node here(Logits(weights + node * NodeTree::kNodeSize, h), prior);
    here.e.Store(e);
    prior.own.Store(own);
    way.Descend(e[child], here.over_sum, own[child]);
  }
  return tree.bin_volume() / way.mass();
}

float TrainNodes(const NodeTree& tree, const float* HWY_RESTRICT weights, const float* HWY_RESTRICT transposed,
                 const CumulativeProbability* field, const float* HWY_RESTRICT h, std::uint32_t bin, float weight,
                 float* HWY_RESTRICT d_weights, float* HWY_RESTRICT d_h) {
  const HalvingGrid& grid = tree.grid();
  Way way;
  HWY_ALIGN float p[kMaxDepth][kChildren], own[kChildren];
  std::array<std::uint32_t, kMaxDepth> nodes, children;
  for (std::uint32_t depth = 0; depth < grid.depth(); ++depth) {
    const std::uint32_t node = nodes[depth] = grid.node_above(bin, depth);
    const std::uint32_t child = children[depth] = grid.child_above(bin, depth);
    const Prior prior(tree, field, node);
    const Node here(Logits(weights + node * NodeTree::kNodeSize, h), prior);
    const V over_sum = hn::Set(d, here.over_sum);
    for (int k = 0; k < kVectors; ++k) hn::Store(hn::Mul(here.e.v[k], over_sum), d, p[depth] + k * kLanes);
    prior.own.Store(own);
    way.Descend(p[depth][child], 1, own[child]);
  }
  // d ln q / d ln (product of p); and d ln p_c / d logit_j = (j == c) - p_j.
  const float pull = weight * (1 - kPriorShare) * way.network / way.mass();
  constexpr int kParts = kNodeFeatures / kLanes;
  V sum[kParts];
  for (int f = 0; f < kParts; ++f) sum[f] = hn::Load(d, d_h + f * kLanes);
  for (std::uint32_t depth = 0; depth < grid.depth(); ++depth) {
    float* HWY_RESTRICT d_logit = p[depth];
    for (int k = 0; k < kVectors; ++k)
      hn::Store(hn::Mul(hn::Set(d, pull), hn::Load(d, d_logit + k * kLanes)), d, d_logit + k * kLanes);
    d_logit[children[depth]] -= pull;
    const Children g = Children::Load(d_logit);
    float* HWY_RESTRICT to = d_weights + nodes[depth] * NodeTree::kNodeSize;
    for (int k = 0; k < kVectors; ++k, to += kLanes) hn::Store(hn::Add(hn::Load(d, to), g.v[k]), d, to);
    for (int f = 0; f < kNodeFeatures; ++f) {
      const V feature = hn::Set(d, h[f]);
      for (int k = 0; k < kVectors; ++k, to += kLanes) hn::Store(hn::MulAdd(feature, g.v[k], hn::Load(d, to)), d, to);
    }
    const float* HWY_RESTRICT w = transposed + std::size_t{nodes[depth]} * kChildren * kNodeFeatures;
    for (std::uint32_t c = 0; c < kChildren; ++c, w += kNodeFeatures) {
      const V by_child = hn::Set(d, d_logit[c]);
      for (int f = 0; f < kParts; ++f) sum[f] = hn::MulAdd(by_child, hn::Load(d, w + f * kLanes), sum[f]);
    }
  }
  for (int f = 0; f < kParts; ++f) hn::Store(sum[f], d, d_h + f * kLanes);
  return std::log(way.mass() / tree.bin_volume());
}

}  // namespace warpath::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace warpath {

HWY_EXPORT(SampleNodes);
HWY_EXPORT(InverseNodeDensity);
HWY_EXPORT(TrainNodes);

void sample_nodes(std::span<NodeDraw> draws) {
  WARPATH_CHECK(draws.size() <= kMostDraws);
  HWY_DYNAMIC_DISPATCH(SampleNodes)(draws.data(), draws.size());
}

float inverse_node_density(const NodeTree& tree, const float* weights, const CumulativeProbability* prior,
                           const float* h, std::uint32_t bin) {
  return HWY_DYNAMIC_DISPATCH(InverseNodeDensity)(tree, weights, prior, h, bin);
}

float train_nodes(const NodeTree& tree, const float* weights, const float* transposed,
                  const CumulativeProbability* prior, const float* h, std::uint32_t bin, float weight, float* d_weights,
                  float* d_h) {
  return HWY_DYNAMIC_DISPATCH(TrainNodes)(tree, weights, transposed, prior, h, bin, weight, d_weights, d_h);
}

NodeTree::NodeTree(const HalvingGrid& grid)
    : m_grid(grid),
      m_nodes(static_cast<std::uint32_t>(grid.stored() / kChildren)),
      m_shares(grid.stored()),
      m_reached(grid.stored()) {
  for (std::uint32_t bin = 0; bin < grid.bins(); ++bin) {
    m_bin_volume = std::max(m_bin_volume, grid.volume(bin));
    for (std::uint32_t depth = 0; depth < grid.depth(); ++depth)
      m_shares[grid.node_above(bin, depth) * kChildren + grid.child_above(bin, depth)] += grid.volume(bin);
  }
  for (std::size_t first = 0; first < m_shares.size(); first += kChildren) {
    float sum = 0;
    for (std::size_t c = first; c < first + kChildren; ++c) m_reached[c] = sum += m_shares[c];
    if (sum > 0)
      for (std::size_t c = first; c < first + kChildren; ++c) m_shares[c] /= sum, m_reached[c] /= sum;
  }
}

void transpose_nodes(const NodeTree& tree, const float* weights, float* transposed) {
  for (std::uint32_t node = 0; node < tree.nodes(); ++node, transposed += NodeTree::kChildren * kNodeFeatures) {
    const float* w = weights + node * NodeTree::kNodeSize + NodeTree::kChildren;
    for (std::size_t f = 0; f < kNodeFeatures; ++f)
      for (std::size_t c = 0; c < NodeTree::kChildren; ++c)
        transposed[c * kNodeFeatures + f] = w[f * NodeTree::kChildren + c];
  }
}

}  // namespace warpath
#endif  // HWY_ONCE
