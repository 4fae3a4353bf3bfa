#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "path/layout.h"
#include "warp/flow_settings.h"
#include "warp/proposal.h"

namespace warpath {

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
