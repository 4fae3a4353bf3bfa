#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/rng.h"
#include "warp/chain.h"
#include "warp/check.h"
#include "warp/grid.h"
#include "warp/kdtree.h"
#include "warp/load.h"
#include "warp/mixture.h"
#include "warp/uniform.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr int kDims[] = {1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 32};

double random(std::uint64_t seed, std::uint64_t i) { return sample_double(sample_key(seed, i), 0); }

/// Edges whose intervals differ by factors of up to 50.
std::shared_ptr<const Grid> uneven_grid(int dims, int bins) {
  Matrix<double> edges(static_cast<std::size_t>(dims), static_cast<std::size_t>(bins) + 1);
  for (std::size_t d = 0; d < edges.rows(); ++d) {
    for (std::size_t k = 1; k < edges.cols(); ++k)
      edges(d, k) = edges(d, k - 1) + std::exp((dims > 8 ? 0.3 : 2) * (2 * random(d, k) - 1));
    const double sum = edges(d, edges.cols() - 1);
    for (std::size_t k = 1; k < edges.cols(); ++k) edges(d, k) /= sum;
    edges(d, edges.cols() - 1) = 1;
  }
  return std::make_shared<Grid>(std::move(edges));
}

/// A tree of random splits with random masses; nodes are split until there are `leaves`, always the first leaf, the
/// last, or one between, so that branches differ in depth.
std::shared_ptr<const KdTree> random_tree(int dims, std::size_t leaves) {
  struct Box {
    float y_low[KdTree::kMaxDims], y_high[KdTree::kMaxDims], z_low[KdTree::kMaxDims], z_high[KdTree::kMaxDims];
  };
  Box root;
  std::fill_n(root.y_low, KdTree::kMaxDims, 0.0f);
  std::fill_n(root.z_low, KdTree::kMaxDims, 0.0f);
  std::fill_n(root.y_high, KdTree::kMaxDims, 1.0f);
  std::fill_n(root.z_high, KdTree::kMaxDims, 1.0f);
  std::vector<Box> boxes{root};
  KdTree::Nodes nodes;
  std::size_t inner = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const bool must_split = boxes.size() - i == 1;  // else the tree would end here
    if (inner + 1 >= leaves || (!must_split && random(1, i) < 0.3)) {
      nodes.dim.push_back(KdTree::Nodes::kLeaf);
      nodes.y_split.push_back(0);
      nodes.z_split.push_back(0);
      continue;
    }
    const auto d = static_cast<std::size_t>(random(2, i) * dims);
    const auto between = [&](float low, float high, double t) { return static_cast<float>(low + t * (high - low)); };
    Box lower = boxes[i], upper = boxes[i];
    lower.y_high[d] = upper.y_low[d] = between(boxes[i].y_low[d], boxes[i].y_high[d], 0.2 + 0.6 * random(3, i));
    lower.z_high[d] = upper.z_low[d] = between(boxes[i].z_low[d], boxes[i].z_high[d], 0.2 + 0.6 * random(4, i));
    nodes.dim.push_back(static_cast<std::uint8_t>(d));
    nodes.y_split.push_back(lower.y_high[d]);
    nodes.z_split.push_back(lower.z_high[d]);
    boxes.push_back(lower);
    boxes.push_back(upper);
    ++inner;
  }
  return std::make_shared<KdTree>(dims, std::move(nodes));
}

std::shared_ptr<const Mixture> mixture_of_all(int dims) {
  return std::make_shared<Mixture>(std::vector<Mixture::Component>{
      {uneven_grid(dims, 7), 2}, {random_tree(dims, 50), 5}, {std::make_shared<Uniform>(dims), 1}});
}

/// Loads what the tests here store; the registry of families, which loads all, is no part of this folder.
std::shared_ptr<const Proposal> load_any(const TensorFile& file, const std::string& prefix) {
  const std::string& family = file.meta(prefix + "family");
  if (family == "uniform") return Uniform::load(file, prefix);
  if (family == "grid") return Grid::load(file, prefix);
  if (family == "kdtree") return KdTree::load(file, prefix);
  if (family == "chain") return Chain::load(file, prefix, load_any);
  if (family == "mixture") return Mixture::load(file, prefix, load_any);
  fail_load(file, prefix, "unknown family");
}

std::shared_ptr<const Proposal> stored_and_loaded(const Proposal& proposal) {
  TensorFile file;
  proposal.save(file, "a.");
  return load_any(file, "a.");
}

/// The same numbers to the last bit.
void expect_same(const Proposal& a, const Proposal& b) {
  EXPECT_EQ(a.family(), b.family());
  ASSERT_EQ(a.dims(), b.dims());
  const auto dims = static_cast<std::size_t>(a.dims());
  Matrix<double> z(100, dims), y_a(100, dims), y_b(100, dims);
  std::vector<double> u(100), q_a(100), q_b(100);
  for (std::size_t i = 0; i < z.values().size(); ++i) z.values()[i] = random(5, i);
  for (std::size_t i = 0; i < 100; ++i) u[i] = random(6, i);
  a.sample(z.batch(), u, y_a.batch(), q_a);
  b.sample(z.batch(), u, y_b.batch(), q_b);
  EXPECT_EQ(y_a.values(), y_b.values());
  EXPECT_EQ(q_a, q_b);
}

TEST(Uniform, KeepsEveryPromise) {
  for (const int dims : kDims) {
    EXPECT_EQ(check_proposal(Uniform(dims)), "");
    EXPECT_EQ(check_warp(Uniform(dims)), "");
    expect_same(Uniform(dims), *stored_and_loaded(Uniform(dims)));
  }
}

TEST(Grid, KeepsEveryPromise) {
  for (const int dims : kDims)
    for (const auto& grid : {std::make_shared<const Grid>(dims, 16), uneven_grid(dims, 1), uneven_grid(dims, 37)}) {
      EXPECT_EQ(check_proposal(*grid), "");
      EXPECT_EQ(check_warp(*grid), "");
      expect_same(*grid, *stored_and_loaded(*grid));
    }
}

TEST(Grid, KeepsEveryPromiseInManyDimensions) {
  for (const int dims : {96, kMaxDims}) {
    const auto grid = uneven_grid(dims, 37);
    EXPECT_EQ(check_warp(*grid), "");
    EXPECT_EQ(check_warp(Uniform(dims)), "");
    expect_same(*grid, *stored_and_loaded(*grid));
  }
}

TEST(Grid, IsTheIdentityUntrained) {
  const Grid grid(3, 10);
  Matrix<double> z(1, 3), y(1, 3);
  z.values() = {0.05, 0.5, 0.999};
  std::vector<double> log_det(1);
  grid.forward(z.batch(), y.batch(), log_det);
  for (std::size_t d = 0; d < 3; ++d) EXPECT_NEAR(y(0, d), z(0, d), 1e-15);
  EXPECT_NEAR(log_det[0], 0, 1e-14);
}

TEST(Grid, BrokenFilesAreRefused) {
  TensorFile file;
  Grid(2, 4).save(file, "a.");
  file.put<double>("a.edges", {2, 3}, std::vector<double>{0, 0.5, 1, 0, 1, 1});
  EXPECT_THROW(load_any(file, "a."), FileError);
  file.put<double>("a.edges", {2, 3}, std::vector<double>{0, NAN, 1, 0, 0.5, 1});
  EXPECT_THROW(load_any(file, "a."), FileError);
  file.put<double>("a.edges", {6}, std::vector<double>{0, 0.5, 1, 0, 0.5, 1});
  EXPECT_THROW(load_any(file, "a."), FileError);
}

TEST(Chain, KeepsEveryPromise) {
  for (const int dims : kDims) {
    const Chain chain(random_tree(dims, 20), uneven_grid(dims, 37));
    EXPECT_EQ(check_proposal(chain), "");
    EXPECT_EQ(check_warp(chain), "");
    expect_same(chain, *stored_and_loaded(chain));
  }
}

TEST(Chain, MultipliesDensities) {
  const auto inner = uneven_grid(2, 5), outer = uneven_grid(2, 7);
  Matrix<double> y(1, 2), x(1, 2);
  y.values() = {0.3, 0.8};
  std::vector<double> log_outer(1), log_inner(1), log_chain(1);
  outer->inverse(y.batch(), x.batch(), log_outer);
  inner->log_density(x.batch(), log_inner);
  Chain(inner, outer).log_density(y.batch(), log_chain);
  EXPECT_NEAR(log_chain[0], log_outer[0] + log_inner[0], 1e-12);
}

TEST(Chain, BrokenFilesAreRefused) {
  TensorFile file;
  Chain(uneven_grid(2, 5), uneven_grid(2, 7)).save(file, "a.");
  TensorFile nested = file, other = file, mixture = file;
  nested.metadata()["a.inner.family"] = "chain";
  EXPECT_THROW(load_any(nested, "a."), FileError);
  Grid(3, 4).save(other, "a.inner.");
  EXPECT_THROW(load_any(other, "a."), FileError);
  mixture_of_all(2)->save(mixture, "a.outer.");
  EXPECT_THROW(load_any(mixture, "a."), FileError) << "a mixture is no bijection";
}

TEST(KdTree, KeepsEveryPromise) {
  for (const int dims : kDims)
    for (const std::size_t leaves : {1u, 2u, 100u}) {
      const auto tree = random_tree(dims, leaves);
      EXPECT_EQ(check_proposal(*tree), "");
      EXPECT_EQ(check_warp(*tree), "");
      expect_same(*tree, *stored_and_loaded(*tree));
    }
}

TEST(KdTree, HoldsInDeepTrees) {
  const auto tree = random_tree(4, 1 << 14);
  EXPECT_EQ(tree->leaf_count(), std::size_t{1} << 14);
  EXPECT_EQ(check_proposal(*tree), "");
}

TEST(KdTree, SplitsMassAndVolume) {
  // Left half of y with 3/4 of the mass, whose upper quarter has a third of that.
  KdTree::Nodes nodes;
  nodes.dim = {0, 1, KdTree::Nodes::kLeaf, KdTree::Nodes::kLeaf, KdTree::Nodes::kLeaf};
  nodes.y_split = {0.5f, 0.75f, 0, 0, 0};
  nodes.z_split = {0.75f, 2.0f / 3, 0, 0, 0};
  const KdTree tree(2, nodes);
  Matrix<double> y(3, 2);
  y.values() = {0.1, 0.1, 0.1, 0.9, 0.9, 0.1};
  std::vector<double> log_q(3);
  tree.log_density(y.batch(), log_q);
  EXPECT_NEAR(std::exp(log_q[0]), 0.75 / 0.5 * (2.0 / 3) / 0.75, 1e-6);
  EXPECT_NEAR(std::exp(log_q[1]), 0.75 / 0.5 * (1.0 / 3) / 0.25, 1e-6);
  EXPECT_NEAR(std::exp(log_q[2]), 0.25 / 0.5, 1e-15);
}

TEST(KdTree, TreesThatCannotBeAreRefused) {
  const std::uint8_t leaf = KdTree::Nodes::kLeaf;
  EXPECT_EQ(KdTree::problem(1, {{leaf}, {0}, {0}}), "");
  EXPECT_EQ(KdTree::problem(1, {{0, leaf, leaf}, {0.5f, 0, 0}, {0.5f, 0, 0}}), "");
  EXPECT_NE(KdTree::problem(33, {{leaf}, {0}, {0}}), "");
  EXPECT_NE(KdTree::problem(1, {{}, {}, {}}), "");
  EXPECT_NE(KdTree::problem(1, {{leaf, leaf}, {0, 0}, {0, 0}}), "");
  EXPECT_NE(KdTree::problem(1, {{leaf, leaf, leaf}, {0, 0, 0}, {0, 0, 0}}), "");
  EXPECT_NE(KdTree::problem(1, {{0, leaf}, {0.5f, 0}, {0.5f, 0}}), "");
  EXPECT_NE(KdTree::problem(1, {{0, leaf, leaf}, {0.5f, 0, 0}, {0.5f, 0}}), "");
  EXPECT_NE(KdTree::problem(1, {{1, leaf, leaf}, {0.5f, 0, 0}, {0.5f, 0, 0}}), "");
  for (const float bad : {0.0f, 1.0f, -1.0f, 2.0f, NAN}) {
    EXPECT_NE(KdTree::problem(1, {{0, leaf, leaf}, {bad, 0, 0}, {0.5f, 0, 0}}), "");
    EXPECT_NE(KdTree::problem(1, {{0, leaf, leaf}, {0.5f, 0, 0}, {bad, 0, 0}}), "");
  }
  // The left child's split lies in the right one's box.
  EXPECT_NE(KdTree::problem(1, {{0, 0, leaf, leaf, leaf}, {0.5f, 0.7f, 0, 0, 0}, {0.5f, 0.2f, 0, 0, 0}}), "");
  EXPECT_THROW(KdTree(1, {{}, {}, {}}), InternalError);
}

TEST(Mixture, KeepsEveryPromise) {
  for (const int dims : kDims) {
    const auto mixture = mixture_of_all(dims);
    EXPECT_EQ(check_proposal(*mixture), "");
    expect_same(*mixture, *stored_and_loaded(*mixture));
  }
}

TEST(Mixture, IsFlatAndNormalised) {
  const auto inner = mixture_of_all(2);
  const Mixture outer({{inner, 3}, {std::make_shared<Uniform>(2), 1}});
  ASSERT_EQ(outer.components().size(), 4u);
  EXPECT_DOUBLE_EQ(outer.components()[1].weight, 0.75 * 5 / 8);
  EXPECT_DOUBLE_EQ(outer.components()[3].weight, 0.25);
  EXPECT_EQ(check_proposal(outer), "");
}

// Stratified u come in the order of the components, and then nothing is copied.
TEST(Mixture, RowsMayComeInAnyOrder) {
  const auto mixture = mixture_of_all(3);
  constexpr std::size_t kRows = 1000, kStep = 333;  // without a common factor
  Matrix<double> z(kRows, 3), y(kRows, 3), shuffled_z(kRows, 3), shuffled_y(kRows, 3);
  std::vector<double> u(kRows), log_q(kRows), shuffled_u(kRows), shuffled_log_q(kRows);
  for (std::size_t i = 0; i < z.values().size(); ++i) z.values()[i] = random(9, i);
  for (std::size_t i = 0; i < kRows; ++i) {
    u[i] = (static_cast<double>(i) + random(10, i)) / kRows;
    const std::size_t to = i * kStep % kRows;
    std::copy_n(&z(i, 0), 3, &shuffled_z(to, 0));
    shuffled_u[to] = u[i];
  }
  mixture->sample(z.batch(), u, y.batch(), log_q);
  mixture->sample(shuffled_z.batch(), shuffled_u, shuffled_y.batch(), shuffled_log_q);
  for (std::size_t i = 0; i < kRows; ++i) {
    const std::size_t to = i * kStep % kRows;
    for (std::size_t d = 0; d < 3; ++d) EXPECT_EQ(y(i, d), shuffled_y(to, d)) << i;
    EXPECT_EQ(log_q[i], shuffled_log_q[to]) << i;
  }
}

TEST(Mixture, BoundsTheWeights) {
  const Mixture mixture({{random_tree(2, 1000), 0.9}, {std::make_shared<Uniform>(2), 0.1}});
  Matrix<double> y(1000, 2);
  for (std::size_t i = 0; i < y.values().size(); ++i) y.values()[i] = random(8, i);
  std::vector<double> log_q(1000);
  mixture.log_density(y.batch(), log_q);
  for (const double value : log_q) EXPECT_GE(value, std::log(0.1));
}

TEST(Mixture, HostileFilesAreRefused) {
  TensorFile file;
  mixture_of_all(2)->save(file, "a.");
  file.metadata()["a.component0.family"] = "mixture";
  EXPECT_THROW(load_any(file, "a."), FileError);
  file.metadata()["a.component0.family"] = "grdi";
  EXPECT_THROW(load_any(file, "a."), FileError);
  file.metadata()["a.component0.family"] = "grid";
  file.metadata()["a.component0.dims"] = "3";
  EXPECT_THROW(load_any(file, "a."), FileError);
  file.metadata()["a.dims"] = "2x";
  EXPECT_THROW(load_any(file, "a."), FileError);
}

}  // namespace
}  // namespace warpath
