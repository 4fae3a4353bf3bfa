#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "warpath/batch.h"

namespace warpath {

/// An interval of the real line.
struct Interval {
  double low = 0, high = 1;
};

struct IntegratorSettings {
  /// auto: a grid, and a spline flow in front of it where that pays; grid+spline: both in any case; uniform, grid,
  /// kdtree, realnvp, spline: that one alone.
  std::string warp = "auto";
  std::uint64_t seed = 0;
  std::string sampler = "sobol";              ///< scrambled Sobol' points, or independent ones
  std::size_t memory = std::size_t{1} << 20;  ///< most points of past iterations that are learned from
};

/// What one iteration says of each of C integrals. Its points come in replicates that are independent of each other,
/// so the spread of their means is that of the estimate.
struct Iteration {
  std::vector<double> mean;        ///< C
  std::vector<double> covariance;  ///< C x C, of the means
  std::uint64_t neval = 0;         ///< points
  std::uint64_t replicates = 0;
  std::uint64_t non_finite = 0;  ///< points where f was not finite; they count as zero
  /// Of the first integral's weights w = f / q: (sum |w|)^2 / sum w^2, how many equal ones would be worth as much, and
  /// mean |w| / max |w|, the share that unweighting would accept.
  double effective_samples = 0, unweighting_efficiency = 0;
  bool adapted = false;       ///< whether the warp learned from it
  std::uint64_t trained = 0;  ///< examples that flows were trained on after it, each as often as it was used
  std::string warp;           ///< that drew it
  double sdev(std::size_t c = 0) const;
};

/// Several iterations together. Those of a fixed warp weigh by their number of points, which keeps the mean unbiased;
/// where the warp adapted in between they weigh by the inverse of the first integral's variance as each estimated it,
/// which is consistent: a bias of the order of 1 / neval, as in VEGAS.
class Integral {
 public:
  explicit Integral(std::vector<Iteration> iterations);

  std::span<const Iteration> iterations() const { return m_iterations; }
  std::size_t count() const { return m_mean.size(); }  ///< C
  double mean(std::size_t c = 0) const { return m_mean[c]; }
  double sdev(std::size_t c = 0) const;
  const std::vector<double>& covariance() const { return m_covariance; }  ///< C x C
  /// Sum over iterations of (their mean - mean)^2 / variance, and its degrees of freedom.
  double chi2(std::size_t c = 0) const;
  int dof() const { return static_cast<int>(m_iterations.size()) - 1; }
  /// The probability of a chi2 at least as large, were all estimates Gaussian and their variances right; 1 for dof 0.
  double Q(std::size_t c = 0) const;
  std::uint64_t neval() const;
  std::uint64_t non_finite() const;
  /// Whether sdev <= max(atol, rtol |mean|) for every integral.
  bool converged(double rtol, double atol) const;
  /// A table, a line for each iteration, of the first integral: `itn  integral  wgt average  chi2/dof  Q`.
  std::string summary() const;

 private:
  std::vector<Iteration> m_iterations;
  std::vector<double> m_weights, m_mean, m_covariance;
};

/// `1.0057(64)`: a value with its standard error in units of the last two digits.
std::string with_error(double mean, double sdev);

/// Integrates functions over a box, and learns a warp that puts points where they count, iteration by iteration.
///
/// integrate() does it all. Whoever must call f himself asks and tells: begin, then draw and add until every point is
/// in, then end. The same numbers for any number of threads.
class Integrator {
 public:
  /// Throws ConfigError for bounds or settings that make no sense.
  explicit Integrator(std::vector<Interval> bounds, IntegratorSettings settings = {});
  ~Integrator();
  Integrator(Integrator&&) noexcept;
  Integrator& operator=(Integrator&&) noexcept;

  int dims() const;
  std::span<const Interval> bounds() const;

  /// x: N x D within the bounds; f: N x C. Called with batches of a few hundred rows, by several threads at once.
  using Function = std::function<void(Batch<const double> x, Batch<double> f)>;
  struct Run {
    int nitn = 10;
    std::size_t neval = 100'000;  ///< points of an iteration, at most
    bool adapt = true;            ///< whether the warp learns from each iteration
    int integrals = 1;            ///< C
  };
  Integral integrate(const Function& f, const Run& run);

  /// Begins an iteration of at most `neval` points, and returns how many it has: a power of two in each replicate.
  std::size_t begin(std::size_t neval);
  /// Points `first` ... `first + x.rows() - 1`, and their weights 1 / density: the mean of weight * f over all points
  /// estimates the integral.
  void draw(std::size_t first, Batch<double> x, std::span<double> weight) const;
  /// Takes f of the next points, in their order, with x and weight as draw gave them. f: N x C, always the same C.
  void add(Batch<const double> x, std::span<const double> weight, Batch<const double> f);
  /// Ends the iteration; the warp learns from it if `adapt`.
  Iteration end(bool adapt);

  /// Independent points that follow the warp, with weights 1 / density: any number, no f, no iteration. Each call has
  /// new ones.
  void sample(Batch<double> x, std::span<double> weight);
  /// weight[i] = 1 / density of x[i]; infinite outside of the bounds, where nothing is drawn.
  void weights(Batch<const double> x, std::span<double> weight) const;

  std::string warp() const;  ///< what draws now: `uniform`, `grid`, `grid+spline`, ...

  /// Bounds and warp as safetensors, atomically. Throws FileError.
  void save(const std::filesystem::path& path) const;
  /// What save wrote; settings.warp must be its family, or `auto`: then it is. Throws FileError that says what is
  /// wrong.
  static Integrator load(const std::filesystem::path& path, IntegratorSettings settings = {});

 private:
  struct State;
  std::unique_ptr<State> m_state;
};

}  // namespace warpath
