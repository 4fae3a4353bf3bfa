#include "warp/check.h"

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <functional>
#include <numeric>

#include "core/rng.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr double kLast = 1 - 0x1p-53;  // the largest double below 1

/// Draws from the uniform density (label 0) and from the proposal (label 1), the label by a fair coin.
struct LabelledDraws {
  Matrix<double> y;
  std::vector<int> label;
  std::vector<double> log_q;         ///< log_density(y)
  std::vector<double> log_q_sample;  ///< what sample said, for label 1
};

Matrix<double> uniform_rows(std::uint64_t seed, std::size_t rows, std::size_t cols) {
  Matrix<double> z(rows, cols);
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t d = 0; d < cols; ++d) z(i, d) = sample_double(sample_key(seed, i), static_cast<std::uint32_t>(d));
  return z;
}

std::vector<double> uniform_numbers(std::uint64_t seed, std::size_t count) {
  return uniform_rows(mix64(seed), count, 1).values();
}

LabelledDraws draw(const Proposal& proposal, const CheckOptions& options) {
  const std::size_t rows = options.samples, dims = static_cast<std::size_t>(proposal.dims());
  LabelledDraws draws{uniform_rows(options.seed, rows, dims), std::vector<int>(rows), std::vector<double>(rows),
                      std::vector<double>(rows)};
  const std::vector<double> u = uniform_numbers(options.seed, rows);
  Matrix<double> y(rows, dims);
  proposal.sample(draws.y.batch(), u, y.batch(), draws.log_q_sample);
  const std::vector<double> coin = uniform_numbers(options.seed + 1, rows);
  for (std::size_t i = 0; i < rows; ++i) {
    draws.label[i] = coin[i] < 0.5;
    if (draws.label[i]) std::copy_n(&y(i, 0), dims, &draws.y(i, 0));
  }
  proposal.log_density(draws.y.batch(), draws.log_q);
  return draws;
}

/// The rows in bins of at least `size`, cut by medians of the dimensions in turn.
void median_bins(const Matrix<double>& y, std::span<std::size_t> rows, std::size_t d, std::size_t size,
                 std::vector<std::span<std::size_t>>& bins) {
  if (rows.size() < 2 * size) return bins.push_back(rows);
  const auto middle = rows.begin() + static_cast<std::ptrdiff_t>(rows.size() / 2);
  std::nth_element(rows.begin(), middle, rows.end(), [&](std::size_t a, std::size_t b) { return y(a, d) < y(b, d); });
  const std::size_t next = (d + 1) % y.cols();
  median_bins(y, rows.first(rows.size() / 2), next, size, bins);
  median_bins(y, rows.subspan(rows.size() / 2), next, size, bins);
}

/// The rows in 16 bins of equal size along some value.
std::vector<std::span<std::size_t>> quantile_bins(std::span<std::size_t> rows,
                                                  const std::function<double(std::size_t)>& value) {
  constexpr std::size_t kBins = 16;  // few, for power against errors that are spread over the whole domain
  std::vector<std::pair<double, std::size_t>> order;
  for (const std::size_t i : rows) order.emplace_back(value(i), i);
  std::sort(order.begin(), order.end());
  std::transform(order.begin(), order.end(), rows.begin(), [](const auto& pair) { return pair.second; });
  std::vector<std::span<std::size_t>> bins;
  for (std::size_t k = 0; k < kBins; ++k) {
    const std::size_t begin = k * rows.size() / kBins, end = (k + 1) * rows.size() / kBins;
    bins.push_back(rows.subspan(begin, end - begin));
  }
  return bins;
}

/// chi^2 of the labels against their probabilities q / (1 + q). Given the draws, the labels are independent coins, so
/// bins may depend on the draws in any way. Bins in which fewer than 20 labels are open (sum of p (1 - p)) are pooled.
std::string chi_square(const LabelledDraws& draws, const std::vector<std::span<std::size_t>>& bins,
                       const std::string& what, const CheckOptions& options) {
  constexpr double kMinVariance = 20;
  double chi2 = 0, excess = 0, variance = 0;
  std::size_t dof = 0;
  std::string histogram;
  for (const auto& bin : bins) {
    for (const std::size_t i : bin) {
      const double p = 1 / (1 + std::exp(-draws.log_q[i]));
      excess += draws.label[i] - p;
      variance += p * (1 - p);
    }
    if (variance < kMinVariance) continue;
    chi2 += excess * excess / variance;
    ++dof;
    if (std::fabs(excess) > 4 * std::sqrt(variance))
      histogram += fmt::format(" [bin {}: {:+.1f} +- {:.1f}]", dof - 1, excess, std::sqrt(variance));
    excess = variance = 0;
  }
  if (dof == 0) return "";
  const double q = boost::math::gamma_q(0.5 * static_cast<double>(dof), 0.5 * chi2);
  if (q >= options.false_alarm) return "";
  return fmt::format("density: chi^2 = {:.1f} for {} bins {} (chance {:.1e}; draws more or fewer than q says:{})\n",
                     chi2, dof, what, q, histogram);
}

std::string check_density(const LabelledDraws& draws, const CheckOptions& options) {
  std::vector<std::size_t> rows(draws.label.size());
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  std::vector<std::span<std::size_t>> cells;
  median_bins(draws.y, rows, 0, 256, cells);
  std::string problems = chi_square(draws, cells, "of a kd-tree", options);
  for (std::size_t d = 0; d < draws.y.cols(); ++d)
    problems += chi_square(draws, quantile_bins(rows, [&](std::size_t i) { return draws.y(i, d); }),
                           fmt::format("of coordinate {}", d), options);
  return problems +
         chi_square(draws, quantile_bins(rows, [&](std::size_t i) { return draws.log_q[i]; }), "of log q", options);
}

/// Tests the mean of numbers in [0, bound] against 1, by Bernstein's inequality: honest for skewed ones too.
std::string check_mean(std::span<const double> values, double second_moment, double bound, const std::string& what,
                       const CheckOptions& options) {
  const double n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  const double log_chance = std::log(2 / options.false_alarm);
  const double limit =
      std::sqrt(2 * std::max(second_moment - 1, 1e-12) * log_chance / n) + 2 * bound * log_chance / (3 * n);
  if (std::fabs(mean - 1) <= limit) return "";
  return fmt::format("{} is {:.6f}, not 1 within {:.6f}\n", what, mean, limit);
}

std::string check_normalised(const Proposal& proposal, const LabelledDraws& draws, const CheckOptions& options) {
  std::vector<double> values;
  for (const double log_q : draws.log_q) values.push_back(2 / (1 + std::exp(-log_q)));
  double second_moment = 0;
  for (const double value : values) second_moment += value * value / static_cast<double>(values.size());
  std::string problems = check_mean(values, second_moment, 2, "mean of 2 q / (1 + q) over half of each", options);
  if (proposal.dims() > 4) return problems;
  // The mean of q^2 over uniform y is that of q over draws from q, which do not miss the peaks.
  second_moment = 0;
  double bound = 0, drawn = 0;
  values.clear();
  for (std::size_t i = 0; i < draws.label.size(); ++i) {
    const double q = std::exp(draws.log_q[i]);
    bound = std::max(bound, q);
    if (draws.label[i]) {
      second_moment += q;
      ++drawn;
    } else {
      values.push_back(q);
    }
  }
  return problems + check_mean(values, second_moment / drawn, bound, "mean of q over uniform y", options);
}

/// Estimates integrals of known value 1 by draws from the proposal.
std::string check_unbiased(const LabelledDraws& draws, const CheckOptions& options) {
  struct Function {
    std::string name;
    std::function<double(std::span<const double>)> f;
  };
  const std::vector<Function> functions{{"1", [](auto) { return 1.0; }},
                                        {"6 / D sum y (1 - y)",
                                         [](auto y) {
                                           double sum = 0;
                                           for (const double x : y) sum += 6 * x * (1 - x);
                                           return sum / static_cast<double>(y.size());
                                         }},
                                        {"product of (y + 1/2) over at most 6 dimensions", [](auto y) {
                                           double product = 1;
                                           for (const double x : y.first(std::min<std::size_t>(6, y.size())))
                                             product *= x + 0.5;
                                           return product;
                                         }}};
  std::string problems;
  for (const Function& function : functions) {
    std::vector<double> values;
    double second_moment = 0, bound = 0, uniform = 0;
    for (std::size_t i = 0; i < draws.label.size(); ++i) {
      const double f = function.f(draws.y.batch().row(i)), weight = f * std::exp(-draws.log_q[i]);
      bound = std::max(bound, weight);
      if (draws.label[i]) {
        values.push_back(weight);
      } else {
        second_moment += f * weight;
        ++uniform;
      }
    }
    problems += check_mean(values, second_moment / uniform, bound,
                           fmt::format("mean of f / q for f = {}", function.name), options);
  }
  return problems;
}

bool in_unit_cube(std::span<const double> y) {
  return std::all_of(y.begin(), y.end(), [](double x) { return x >= 0 && x < 1; });
}

/// Latents with coordinates at and near the border, and within.
Matrix<double> border_latents(std::size_t dims, std::uint64_t seed) {
  constexpr double kValues[] = {0, 0x1p-1074, 1e-300, 0x1p-60, 1e-12, 1e-6, 0.5, 1 - 1e-6, 1 - 1e-12, kLast};
  Matrix<double> z = uniform_rows(seed, 512, dims);
  for (std::size_t i = 0; i < z.rows(); ++i)
    for (std::size_t d = 0; d < dims; ++d) {
      const std::uint64_t bits = sample_bits(sample_key(seed + 1, i), static_cast<std::uint32_t>(d));
      if (i < std::size(kValues)) {
        z(i, d) = kValues[i];
      } else if (bits % 2 == 0) {
        z(i, d) = kValues[(bits >> 8) % std::size(kValues)];
      }
    }
  return z;
}

/// Border latents in one batch; then in place, strided, and in small batches, which must give the same.
std::string check_batches(const Proposal& proposal, const CheckOptions& options) {
  const auto dims = static_cast<std::size_t>(proposal.dims());
  const Matrix<double> z = border_latents(dims, options.seed + 2);
  const std::vector<double> u = uniform_numbers(options.seed + 3, z.rows());
  Matrix<double> y(z.rows(), dims);
  std::vector<double> log_q(z.rows());
  proposal.sample(z.batch(), u, y.batch(), log_q);
  for (std::size_t i = 0; i < z.rows(); ++i)
    if (!in_unit_cube(y.batch().row(i)) || !std::isfinite(log_q[i]))
      return fmt::format("border: latent ({}) gives ({}) with log q = {}\n", fmt::join(z.batch().row(i), ", "),
                         fmt::join(y.batch().row(i), ", "), log_q[i]);

  const std::size_t stride = dims + 3;
  std::vector<double> strided(z.rows() * stride, -1.0), log_q_2(z.rows());
  const Batch<double> in_place(strided.data(), z.rows(), dims, stride);
  for (std::size_t i = 0; i < z.rows(); ++i) std::copy_n(&z(i, 0), dims, &in_place(i, 0));
  std::size_t first = 0;
  for (std::size_t size = 1; first < z.rows(); first += size, size = size % 67 + 6) {
    size = std::min(size, z.rows() - first);
    const Batch<double> batch = in_place.rows_from(first, size);
    proposal.sample(batch, std::span(u).subspan(first, size), batch, std::span(log_q_2).subspan(first, size));
  }
  for (std::size_t i = 0; i < z.rows(); ++i) {
    for (std::size_t d = 0; d < dims; ++d)
      if (std::fabs(in_place(i, d) - y(i, d)) > options.log_q_tolerance ||
          std::fabs(log_q[i] - log_q_2[i]) > options.log_q_tolerance)
        return fmt::format("batches: row {} is ({}) with log q = {} in one batch, ({}) with {} in place in another\n",
                           i, fmt::join(y.batch().row(i), ", "), log_q[i], fmt::join(in_place.row(i), ", "),
                           log_q_2[i]);
    for (std::size_t d = dims; d < stride; ++d)
      if (strided[i * stride + d] != -1.0) return fmt::format("batches: wrote behind row {}\n", i);
  }
  return "";
}

/// What makes every further figure meaningless.
std::string check_finite(const LabelledDraws& draws) {
  for (std::size_t i = 0; i < draws.label.size(); ++i) {
    const auto y = draws.y.batch().row(i);
    if (!in_unit_cube(y)) return fmt::format("y = ({}) is not in [0,1)\n", fmt::join(y, ", "));
    if (std::isnan(draws.log_q[i]) || draws.log_q[i] == HUGE_VAL)
      return fmt::format("log_density is {} at ({})\n", draws.log_q[i], fmt::join(y, ", "));
    if (draws.label[i] && !(std::isfinite(draws.log_q[i]) && std::isfinite(draws.log_q_sample[i])))
      return fmt::format("sample says log q = {}, log_density {} at ({})\n", draws.log_q_sample[i], draws.log_q[i],
                         fmt::join(y, ", "));
  }
  return "";
}

std::string check_log_q(const LabelledDraws& draws, const CheckOptions& options) {
  double worst = 0;
  for (std::size_t i = 0; i < draws.label.size(); ++i)
    if (draws.label[i]) worst = std::max(worst, std::fabs(draws.log_q[i] - draws.log_q_sample[i]));
  if (worst <= options.log_q_tolerance) return "";
  return fmt::format("log q of sample and log_density differ by {:.3g}\n", worst);
}

std::string with_seed(const std::string& problems, const Proposal& proposal, const CheckOptions& options) {
  if (problems.empty()) return "";
  return fmt::format("{} in {}D, seed {}, {} draws, false-alarm rate {} per test:\n{}", proposal.family(),
                     proposal.dims(), options.seed, options.samples, options.false_alarm, problems);
}

double log_abs_determinant(std::vector<double> m, std::size_t n) {
  double log_det = 0;
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k; i < n; ++i)
      if (std::fabs(m[i * n + k]) > std::fabs(m[pivot * n + k])) pivot = i;
    std::swap_ranges(&m[k * n], &m[k * n] + n, &m[pivot * n]);
    log_det += std::log(std::fabs(m[k * n + k]));
    for (std::size_t i = k + 1; i < n; ++i) {
      const double factor = m[i * n + k] / m[k * n + k];
      for (std::size_t j = k; j < n; ++j) m[i * n + j] -= factor * m[k * n + j];
    }
  }
  return log_det;
}

std::string check_differences(const Warp& warp, const CheckOptions& options) {
  const auto dims = static_cast<std::size_t>(warp.dims());
  const double h = options.difference_step;
  constexpr std::size_t kPoints = 400;
  std::size_t smooth = 0;
  double worst = 0;
  const Matrix<double> points = uniform_rows(options.seed + 4, kPoints, dims);
  for (std::size_t p = 0; p < kPoints; ++p) {
    // The point itself, then one step back and one ahead in each dimension.
    Matrix<double> z(1 + 2 * dims, dims), y(1 + 2 * dims, dims);
    std::vector<double> log_det(z.rows());
    for (std::size_t i = 0; i < z.rows(); ++i)
      for (std::size_t d = 0; d < dims; ++d)
        z(i, d) = std::clamp(points(p, d), 2 * h, 1 - 2 * h) + (i == 1 + 2 * d ? -h : i == 2 + 2 * d ? h : 0.0);
    warp.forward(z.batch(), y.batch(), log_det);
    std::vector<double> central(dims * dims);
    double kink = 0;  // relative to what moves that coordinate of y most
    for (std::size_t j = 0; j < dims; ++j) {
      double scale = 0, bend = 0;
      for (std::size_t d = 0; d < dims; ++d) {
        const double back = (y(0, j) - y(1 + 2 * d, j)) / h, ahead = (y(2 + 2 * d, j) - y(0, j)) / h;
        central[j * dims + d] = 0.5 * (back + ahead);
        scale = std::max(scale, std::fabs(central[j * dims + d]));
        bend = std::max(bend, std::fabs(ahead - back));
      }
      kink = std::max(kink, bend / scale);
    }
    if (!(kink <= options.kink)) continue;
    ++smooth;
    const double difference = std::fabs(log_abs_determinant(central, dims) - log_det[0]);
    worst = std::max(worst, std::isnan(difference) ? HUGE_VAL : difference);
  }
  if (smooth < kPoints / 2) return fmt::format("log_det: only {} of {} points are smooth\n", smooth, kPoints);
  if (worst <= options.log_det_tolerance) return "";
  return fmt::format("log_det differs from central differences by {:.3g}\n", worst);
}

}  // namespace

std::string check_proposal(const Proposal& proposal, const CheckOptions& options) {
  const LabelledDraws draws = draw(proposal, options);
  std::string problems = check_finite(draws);
  if (problems.empty())
    problems = check_batches(proposal, options) + check_log_q(draws, options) + check_density(draws, options) +
               check_normalised(proposal, draws, options) + check_unbiased(draws, options);
  return with_seed(problems, proposal, options);
}

std::string check_warp(const Warp& warp, const CheckOptions& options) {
  const auto dims = static_cast<std::size_t>(warp.dims());
  std::string problems;
  const std::size_t rows = std::min<std::size_t>(options.samples, 4096);
  Matrix<double> border = border_latents(dims, options.seed + 6);
  for (double& x : border.values()) x = std::min(x, 1 - options.border);
  for (const Matrix<double>& start : {uniform_rows(options.seed + 5, rows, dims), border}) {
    Matrix<double> there(start.rows(), dims), back(start.rows(), dims);
    std::vector<double> log_there(start.rows()), log_back(start.rows());
    double worst_y = 0, worst_z = 0, worst_log = 0;
    for (const bool from_y : {true, false}) {
      if (from_y) {
        warp.inverse(start.batch(), there.batch(), log_there);
        warp.forward(there.batch(), back.batch(), log_back);
      } else {
        warp.forward(start.batch(), there.batch(), log_there);
        warp.inverse(there.batch(), back.batch(), log_back);
      }
      for (std::size_t i = 0; i < start.rows(); ++i) {
        if (!in_unit_cube(there.batch().row(i)) || !in_unit_cube(back.batch().row(i)))
          problems += fmt::format("({}) leaves the cube\n", fmt::join(start.batch().row(i), ", "));
        // Where the map of z onto y is steep or flat, rounding of the one is a larger step of the other.
        const double stretch = from_y ? 1 : std::exp(std::fabs(log_there[i]));
        for (std::size_t d = 0; d < dims; ++d) {
          const double difference = std::fabs(start(i, d) - back(i, d));
          double& worst = from_y ? worst_y : worst_z;
          worst = std::max(worst, difference / stretch);
        }
        worst_log = std::max(worst_log, std::fabs(log_there[i] + log_back[i]) / stretch);
      }
    }
    if (!(worst_y <= options.y_tolerance)) problems += fmt::format("forward(inverse(y)) is off by {:.3g}\n", worst_y);
    if (!(worst_z <= options.y_tolerance)) problems += fmt::format("inverse(forward(z)) is off by {:.3g}\n", worst_z);
    if (!(worst_log <= options.log_q_tolerance))
      problems += fmt::format("log_det there and back add up to {:.3g}\n", worst_log);
  }
  if (warp.dims() <= 6) problems += check_differences(warp, options);
  return with_seed(problems, warp, options);
}

}  // namespace warpath
