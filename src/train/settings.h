#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "path/layout.h"
#include "warp/proposal.h"

namespace warpath {

/// How a normalising flow is trained, whatever its layers are.
struct FlowTraining {
  /// What training minimises: -ln q, the paper's maximum likelihood; or the variance of the estimate g / q, by way of
  /// ln E[g / q] over examples that were drawn by g, with q mixed with `uniform`: the chi-squared divergence of
  /// [MMRGN19]. The second one mends the tails.
  enum class Loss { likelihood, variance } loss = Loss::variance;
  double rate = 6e-3;  ///< Adam's step size at the start; it falls when the held-out loss no longer does
  int batch = 2000;
  int max_steps = 10'000;               ///< training ends sooner, when the held-out loss no longer falls
  double held_out = 0.05;               ///< share of the examples that is never trained on
  double expected_uniform_share = 0.1;  ///< of the samples that are drawn, which Loss::variance counts on
  /// Each time an example is shown, it is moved by a Gaussian of jitter / sqrt(examples) in each dimension (as wide as
  /// a slab that holds sqrt(examples) of them, times this), so that small sets are not learned by heart. 0: not at all.
  double jitter = 0;
  double average = 0.998;    ///< decay per step of the moving average of the weights that is handed out; 0 for none
  int evaluate_every = 100;  ///< steps between evaluations of the held-out loss
  int patience = 3;    ///< evaluations without gain, after which the rate falls to a third, and at last training ends
  int rate_drops = 2;  ///< how often the rate falls
};

/// Settings of the Real NVP warp and its training. Defaults are the ones that docs/results.md measures.
struct RealNvpSettings : FlowTraining {
  RealNvpSettings() { jitter = 2; }
  int couplings = 16;
  int width = 32;
  int blocks = 1;          ///< residual blocks of two dense layers in each of s and t
  int encoding_bins = 15;  ///< of the one-blob encoding of what the networks see [MMRGN19]; 0: logits alone
  bool shared = true;      ///< s and t from one network with two heads; the paper has two
  /// Which dimensions a coupling moves: every other one, or halves that change from pair to pair of couplings, so that
  /// any two dimensions come to stand on different sides.
  enum class Masks { alternating, binary } masks = Masks::binary;
  enum class Norm { none, actnorm, batch } norm = Norm::actnorm;
};
/// The architecture that the authors of [ZZ19] released, and their training: 12 couplings, separate s and t, 512 wide,
/// 8 blocks, maximum likelihood at rate 1e-4.
RealNvpSettings released_realnvp();

/// Settings of the rational-quadratic spline flow [DBMP19] and its training.
struct SplineSettings : FlowTraining {
  SplineSettings() {
    rate = 1e-2;
    max_steps = 2000;
  }
  int couplings = 6;       ///< with Masks::autoregressive: layers of as many couplings as there are dimensions
  int width = 32;          ///< neurons in a hidden layer, a multiple of 16
  int blocks = 1;          ///< residual blocks of two dense layers in each coupling's network
  int bins = 8;            ///< of each spline, 2 to 64
  int encoding_bins = 32;  ///< of the one-blob encoding of what the networks see [MMRGN19]; 0: the numbers alone
  /// binary: a coupling moves half of the dimensions, given the others, and the halves change from pair to pair;
  /// autoregressive: it moves one, given those before it, or, in every other layer, those behind it.
  enum class Masks { binary, autoregressive } masks = Masks::binary;
};

/// Settings of the conditional spline: flows over the numbers of a vertex, given what a path knows there. They learn
/// while they render.
struct ConditionalSplineSettings {
  ConditionalSplineSettings() {
    flow.masks = SplineSettings::Masks::autoregressive;
    flow.couplings = 1;
    flow.bins = flow.encoding_bins = 16;
    flow.rate = 5e-3;
  }
  SplineSettings flow;  ///< shape, loss, step size and batch; max_steps and what follows it mean nothing here
  int position_bins = 8, film_bins = 16;  ///< of one-blob encodings, along each axis
  Layout numbers;                         ///< that are warped: bounce1.lobe+bounce1.dir, ...
  double visits = 0.1;                    ///< examples trained on after a pass, over its vertices,
  int min_visits = 1 << 17;               ///< and at least
  double clip = 20;  ///< what comes back counts as so many times the brightness around it at most: in training only
  int most_examples = 1 << 20;  ///< kept of all passes, drawn by what they brought; 96 bytes each
};

struct KdTreeSettings {
  enum class Target { mean, second_moment } target = Target::mean;  ///< density of a cell ~ mean g, or sqrt(E[g^2])
  /// cyclic: brightest cell first, in the middle, dimensions in turn, as in [GBBE18]; best: wherever a split gains most
  enum class Split { cyclic, best } split = Split::best;
  int max_leaves = 1 << 14;
  int min_samples = 50;  ///< candidates in a leaf
  double shrink = 16;    ///< a cell's mean is drawn to its parent's, the more the noisier the target; 0 believes it
};

/// Settings of the conditional kd-tree: a tree over the numbers of a vertex for each tile of the film. It learns while
/// it renders.
struct ConditionalKdTreeSettings {
  ConditionalKdTreeSettings() {
    tree.target = KdTreeSettings::Target::second_moment;
    tree.max_leaves = 256;
    tree.shrink = 10;
  }
  KdTreeSettings tree;          ///< of each tile
  Layout numbers;               ///< that are warped, of one vertex: bounce1.lobe+bounce1.dir, ...
  int tiles = 24;               ///< across the longer side of the film; they are about square
  int tilings = 3;              ///< cuts of the film into tiles, each shifted by a part of one
  int most_examples = 1 << 21;  ///< kept of all passes; 36 bytes each
};

/// Settings of the field, the warp that lives at every vertex and learns while it renders.
struct FieldSettings {
  std::uint32_t max_cells = 1 << 15;
  double split_at = 2500;  ///< vertices in a cell after which it is cut in two
  /// A bin is drawn to those around it as if by so many samples of theirs, unless it differs from them for certain.
  double shrink = 48;
  double first_uniform_share = 0.4;  ///< of a cell's numbers, until it has found out which share is best for it
  double trust = 1;  ///< effective samples of a cell, (sum f)^2 / sum f^2, that count as much as the uniform density
  Layout numbers;    ///< that are warped: bounce1.lobe+bounce1.dir, ...; empty: those of every vertex
};

struct GridSettings {
  int intervals = 128;  ///< in each dimension
  int iterations = 10;
  double alpha = 0.5;  ///< VEGAS's damping
  /// Share of z that an interval is given ~ mean of g, or sqrt(E[g^2 / q]), which is VEGAS's and best if known well.
  enum class Target { mean, second_moment } target = Target::second_moment;
};

struct TrainSettings {
  TrainSettings() { kdtree.target = KdTreeSettings::Target::second_moment; }
  std::uint64_t examples = 16 * 200 * 160;  ///< |S|; epp-k is k x 200 x 160
  double alpha = 8;                         ///< |T| / |S|
  double uniform_share = 0.1;               ///< of the samples of a mixture; 0 hands out the bare warp
  std::uint64_t seed = 0;
  RealNvpSettings realnvp;
  SplineSettings spline;
  ConditionalSplineSettings conditional_spline;
  ConditionalKdTreeSettings conditional_kdtree;
  KdTreeSettings kdtree;
  GridSettings grid;
  FieldSettings field;
  std::filesystem::path init;     ///< a saved warp to start from; empty: none
  bool candidates_count = false;  ///< in the image
};

/// How training went: one point per evaluation of the held-out likelihood.
struct TrainLog {
  struct Point {
    double seconds;          ///< since training began
    std::uint64_t samples;   ///< examples seen, with repetition
    double loss;             ///< mean -ln q over the last training batches; with Loss::variance, ln E[g / q]
    double held_out;         ///< the same over the examples held out
    double cpu_seconds = 0;  ///< of all threads, since training began
  };
  std::vector<Point> points;
  double seconds = 0;
  std::string stopped;     ///< why it ended: `held-out likelihood no longer rises`, `max_steps`, ...
  double cpu_seconds = 0;  ///< of all threads
};

struct Fit {
  std::shared_ptr<const Proposal> proposal;
  TrainLog log;
};

}  // namespace warpath
