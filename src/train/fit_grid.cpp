#include "train/fit_grid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "warp/scratch.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::size_t kChunks = 64;    // that are summed apart: fixed, so that sums do not depend on threads
constexpr std::size_t kBatch = 1024;   // rows that go through the map at once
constexpr double kLeastGain = 0.9999;  // iterations end when the second moment falls by less than this factor

/// Sums of what the map should follow, by dimension and interval, and of g^2 / q over all.
struct Moments {
  Matrix<double> by_bin;
  double all = 0;
};

Moments moments_under(const Examples& examples, const Grid& grid, GridSettings::Target target) {
  const std::size_t dims = examples.y.cols();
  const auto bins = static_cast<std::size_t>(grid.bins());
  std::vector<Moments> parts(kChunks, {Matrix<double>(dims, bins)});
  tbb::parallel_for(std::size_t{0}, kChunks, [&](std::size_t chunk) {
    Moments& part = parts[chunk];
    const std::size_t begin = examples.size() * chunk / kChunks, end = examples.size() * (chunk + 1) / kChunks;
    const Scratch<double> y(kBatch * dims), log_q(kBatch), weight(kBatch), g(kBatch);
    for (std::size_t i = begin; i < end;) {
      std::size_t rows = 0;
      for (; i < end && rows < kBatch; ++i) {
        weight[rows] = examples.weight[i];
        if (!(weight[rows] > 0)) continue;
        std::copy_n(&examples.y(i, 0), dims, &y[rows * dims]);
        g[rows] = weight[rows] / (examples.inv_q.empty() ? 1.0 : examples.inv_q[i]);
        ++rows;
      }
      const Batch<double> batch(y.data(), rows, dims);
      grid.inverse(batch, batch, {log_q.data(), rows});
      for (std::size_t r = 0; r < rows; ++r) {
        const double moment = weight[r] * g[r] * std::exp(-log_q[r]);
        part.all += moment;
        const double part_of_bin = target == GridSettings::Target::mean ? weight[r] : moment;
        for (std::size_t d = 0; d < dims; ++d)
          part.by_bin(d, std::min(static_cast<std::size_t>(batch(r, d) * static_cast<double>(bins)), bins - 1)) +=
              part_of_bin;
      }
    }
  });
  for (std::size_t chunk = 1; chunk < kChunks; ++chunk) {
    parts[0].all += parts[chunk].all;
    for (std::size_t k = 0; k < parts[0].by_bin.values().size(); ++k)
      parts[0].by_bin.values()[k] += parts[chunk].by_bin.values()[k];
  }
  return std::move(parts[0]);
}

/// New edges of one dimension: intervals shrink where they hold more than their share. Smoothed with the weights 1, 6,
/// 1 and damped, ((share - 1) / ln share)^alpha, as in Lepage's later vegas.
std::vector<double> refined(std::span<const double> edges, std::span<const double> moments, double alpha) {
  const std::size_t bins = moments.size();
  std::vector<double> share(bins);
  double sum = 0;
  for (std::size_t k = 0; k < bins; ++k) {
    share[k] = (moments[k == 0 ? 0 : k - 1] + 6 * moments[k] + moments[std::min(k + 1, bins - 1)]) / 8;
    sum += share[k];
  }
  double total = 0;
  for (double& s : share) {
    s /= sum;
    s = s <= 0 ? 0 : s >= 1 ? 1 : std::pow((s - 1) / std::log(s), alpha);
    total += s;
  }
  // Every new interval holds the same part of the total.
  std::vector<double> result(bins + 1, 0.0);
  double passed = 0;  // in the old intervals before `old`
  std::size_t old = 0;
  for (std::size_t k = 1; k < bins; ++k) {
    const double wanted = total * static_cast<double>(k) / static_cast<double>(bins);
    while (old + 1 < bins && passed + share[old] < wanted) passed += share[old++];
    const double within = share[old] > 0 ? std::clamp((wanted - passed) / share[old], 0.0, 1.0) : 1.0;
    result[k] = edges[old] + within * (edges[old + 1] - edges[old]);
  }
  result[bins] = 1;
  // Equal edges, where all the moment is in a point, are moved apart; a map must increase.
  constexpr double kMinWidth = 1e-9;
  for (std::size_t k = 1; k < bins; ++k) result[k] = std::max(result[k], result[k - 1] + kMinWidth);
  for (std::size_t k = bins; k-- > 1;) result[k] = std::min(result[k], result[k + 1] - kMinWidth);
  return result;
}

}  // namespace

std::shared_ptr<const Grid> fit_grid(const Examples& examples, const GridSettings& settings, const Grid* init) {
  const std::size_t dims = examples.y.cols();
  WARPATH_CHECK_EQ(examples.weight.size(), examples.size());
  if (settings.intervals < 1 || settings.intervals > 100'000)
    throw ConfigError(fmt::format("grid: {} intervals, not 1 to 100000", settings.intervals));
  if (settings.iterations < 1) throw ConfigError("grid: needs at least 1 iteration");
  if (!(settings.alpha >= 0)) throw ConfigError("grid: alpha must not be negative");
  if (init && init->dims() != static_cast<int>(dims))
    throw ConfigError(fmt::format("grid: the map to start from has {} dimensions, not {}", init->dims(), dims));
  auto grid = init ? std::make_shared<const Grid>(*init)
                   : std::make_shared<const Grid>(static_cast<int>(dims), settings.intervals);
  std::shared_ptr<const Grid> best = grid;
  double least = std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration <= settings.iterations; ++iteration) {
    const Moments moments = moments_under(examples, *grid, settings.target);
    if (!(moments.all > 0)) break;
    const bool gained = moments.all < kLeastGain * least;
    if (moments.all < least) {
      least = moments.all;
      best = grid;
    }
    if (iteration == settings.iterations || (!gained && settings.target == GridSettings::Target::second_moment)) break;
    Matrix<double> edges(dims, grid->edges().cols());
    for (std::size_t d = 0; d < dims; ++d) {
      const auto row = refined(grid->edges().batch().row(d), moments.by_bin.batch().row(d), settings.alpha);
      std::copy(row.begin(), row.end(), &edges(d, 0));
    }
    grid = std::make_shared<Grid>(std::move(edges));
  }
  return best;
}

Grid halved(const Grid& grid) {
  const Matrix<double>& edges = grid.edges();
  Matrix<double> half(edges.rows(), 2 * edges.cols() - 1);
  for (std::size_t d = 0; d < half.rows(); ++d)
    for (std::size_t k = 0; k < half.cols(); ++k)
      half(d, k) = k % 2 == 0 ? edges(d, k / 2) : 0.5 * (edges(d, k / 2) + edges(d, k / 2 + 1));
  return Grid(std::move(half));
}

}  // namespace warpath
