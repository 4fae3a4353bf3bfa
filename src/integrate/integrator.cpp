#include "warpath/integrator.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/rng.h"
#include "core/tensor_file.h"
#include "family/family.h"
#include "integrate/learner.h"
#include "integrate/points.h"
#include "integrate/replicate_sums.h"
#include "warp/mixture.h"
#include "warp/scratch.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::size_t kBatch = 1024;       // rows that one thread draws at once
constexpr std::size_t kChunk = 64 * 1024;  // rows that wait for each other in integrate
constexpr std::size_t kLeastNeval = 64;
constexpr char kPrefix[] = "warp.";
constexpr char kKind[] = "integrator";

Points::Kind kind_of(const std::string& sampler) {
  if (sampler == "sobol") return Points::Kind::sobol;
  if (sampler == "independent") return Points::Kind::independent;
  throw ConfigError(fmt::format("unknown sampler \"{}\"; known: sobol, independent", sampler));
}

/// What a proposal learned, apart from what defends it.
const Proposal& main_component(const Proposal& proposal) {
  const auto* mixture = dynamic_cast<const Mixture*>(&proposal);
  return mixture ? *mixture->components().front().proposal : proposal;
}

/// What the state keeps of the iteration under way.
struct UnderWay {
  Points points;
  std::shared_ptr<const Proposal> proposal;
  ReplicateSums sums;
  Examples examples;
  std::vector<double> values;  // |f| / q, which become the examples' weights
  std::size_t taken = 0;
};

}  // namespace

struct Integrator::State {
  std::vector<Interval> bounds;
  IntegratorSettings settings;
  Points::Kind kind;
  Learner learner;
  double volume = 1;
  std::uint64_t iterations = 0;  // and samples drawn: each has a number, which seeds it
  double scale = 0;              // of all examples' weights, which are floats: the largest of the first iteration is 1
  std::unique_ptr<UnderWay> under_way;

  State(std::vector<Interval> b, IntegratorSettings s)
      : bounds(std::move(b)),
        settings(std::move(s)),
        kind(kind_of(settings.sampler)),
        learner(static_cast<int>(bounds.size()), settings.warp, settings.seed, settings.memory) {
    for (const Interval& i : bounds) {
      if (!(i.low < i.high) || !std::isfinite(i.high - i.low))
        throw ConfigError(
            fmt::format("bounds {} to {}: the first must be below the second, and both finite", i.low, i.high));
      volume *= i.high - i.low;
    }
  }

  Points points(Points::Kind of_kind, std::size_t count) {
    return {of_kind, settings.seed, iterations++, count, learner.defended()};
  }

  /// Rows `first` ... of points, by all threads.
  void draw(const Points& points, const Proposal& proposal, std::size_t first, Batch<double> x,
            std::span<double> weight) const {
    WARPATH_CHECK_EQ(x.cols(), bounds.size());
    WARPATH_CHECK_EQ(x.rows(), weight.size());
    parallel((x.rows() + kBatch - 1) / kBatch, [&](std::size_t b) {
      const std::size_t begin = b * kBatch, rows = std::min(kBatch, x.rows() - begin);
      const Batch<double> y = x.rows_from(begin, rows);
      const Scratch<double> u(rows);
      const std::span<double> log_q = weight.subspan(begin, rows);
      points.fill(first + begin, y, {u.data(), rows});
      proposal.sample(y, {u.data(), rows}, y, log_q);
      for (std::size_t i = 0; i < rows; ++i) {
        for (std::size_t d = 0; d < bounds.size(); ++d)
          y(i, d) = std::min(bounds[d].low + y(i, d) * (bounds[d].high - bounds[d].low), bounds[d].high);
        log_q[i] = volume * std::exp(-log_q[i]);
      }
    });
  }

  /// Puts the values of an iteration into its examples. Only the largest can set the scale: beside a first one from a
  /// tail all others would be beyond what floats hold.
  void scale_weights(UnderWay& now) {
    if (scale == 0) {
      const double most = *std::max_element(now.values.begin(), now.values.end());
      if (most > 0) scale = 1 / std::max(most, 1e-300);
    }
    for (std::size_t i = 0; i < now.values.size(); ++i)
      now.examples.weight[i] = static_cast<float>(std::min(now.values[i] * scale, 1e30));
  }

  bool holds(std::span<const double> x) const {
    for (std::size_t d = 0; d < bounds.size(); ++d)
      if (!(x[d] >= bounds[d].low && x[d] <= bounds[d].high)) return false;
    return true;
  }

  double to_unit(std::size_t d, double x) const {
    return std::clamp((x - bounds[d].low) / (bounds[d].high - bounds[d].low), 0.0, 1 - 0x1p-53);
  }
};

Integrator::Integrator(std::vector<Interval> bounds, IntegratorSettings settings)
    : m_state(std::make_unique<State>(std::move(bounds), std::move(settings))) {}
Integrator::~Integrator() = default;
Integrator::Integrator(Integrator&&) noexcept = default;
Integrator& Integrator::operator=(Integrator&&) noexcept = default;

int Integrator::dims() const { return static_cast<int>(m_state->bounds.size()); }
std::span<const Interval> Integrator::bounds() const { return m_state->bounds; }
std::string Integrator::warp() const { return m_state->learner.description(); }

std::size_t Integrator::begin(std::size_t neval) {
  if (neval < kLeastNeval) throw ConfigError(fmt::format("neval is {}, not at least {}", neval, kLeastNeval));
  auto now = std::make_unique<UnderWay>();
  now->points = m_state->points(m_state->kind, neval);
  now->proposal = m_state->learner.proposal(now->points.second_share());
  const std::size_t count = now->points.count(), rows = std::min(count, m_state->settings.memory);
  now->examples = {Matrix<float>(rows, m_state->bounds.size()), std::vector<float>(rows), std::vector<float>(rows)};
  now->values.resize(rows);
  m_state->under_way = std::move(now);
  return count;
}

void Integrator::draw(std::size_t first, Batch<double> x, std::span<double> weight) const {
  WARPATH_CHECK(m_state->under_way);
  m_state->draw(m_state->under_way->points, *m_state->under_way->proposal, first, x, weight);
}

void Integrator::add(Batch<const double> x, std::span<const double> weight, Batch<const double> f) {
  WARPATH_CHECK(m_state->under_way);
  UnderWay& now = *m_state->under_way;
  WARPATH_CHECK_EQ(x.rows(), f.rows());
  WARPATH_CHECK_EQ(weight.size(), f.rows());
  WARPATH_CHECK(now.taken + f.rows() <= now.points.count());
  if (now.taken == 0) now.sums = ReplicateSums(f.cols(), now.points.replicate_size());
  now.sums.add(f, weight);
  Examples& examples = now.examples;
  for (std::size_t i = 0; i < f.rows() && now.taken + i < examples.size(); ++i) {
    const std::size_t row = now.taken + i;
    for (std::size_t d = 0; d < x.cols(); ++d) examples.y(row, d) = to_primary(m_state->to_unit(d, x(i, d)));
    const double value = std::abs(weight[i] * f(i, 0));
    now.values[row] = std::isfinite(value) ? value : 0;
    examples.inv_q[row] = static_cast<float>(weight[i] / m_state->volume);
  }
  now.taken += f.rows();
}

Iteration Integrator::end(bool adapt) {
  WARPATH_CHECK(m_state->under_way);
  const std::unique_ptr<UnderWay> now = std::move(m_state->under_way);
  WARPATH_CHECK_EQ(now->taken, now->points.count());
  Iteration result = now->sums.result();
  result.warp = warp();
  if (!adapt) return result;
  result.adapted = true;
  const double relative = result.mean[0] == 0 ? 0 : result.sdev() / std::abs(result.mean[0]);
  m_state->scale_weights(*now);
  const std::uint64_t before = m_state->learner.trained();
  m_state->learner.learn(std::move(now->examples), relative * relative * static_cast<double>(result.neval));
  result.trained = m_state->learner.trained() - before;
  return result;
}

Integral Integrator::integrate(const Function& f, const Run& run) {
  if (run.nitn < 1) throw ConfigError(fmt::format("{} iterations; there must be at least 1", run.nitn));
  if (run.integrals < 1) throw ConfigError(fmt::format("{} integrals; there must be at least 1", run.integrals));
  std::vector<Iteration> iterations;
  const auto dims = m_state->bounds.size(), channels = static_cast<std::size_t>(run.integrals);
  for (int k = 0; k < run.nitn; ++k) {
    const std::size_t count = begin(run.neval), chunk = std::min(count, kChunk);
    Matrix<double> x(chunk, dims), values(chunk, channels);
    std::vector<double> weight(chunk);
    for (std::size_t first = 0; first < count; first += chunk) {
      const std::size_t rows = std::min(chunk, count - first);
      const auto xs = x.batch().rows_from(0, rows), fs = values.batch().rows_from(0, rows);
      draw(first, xs, {weight.data(), rows});
      parallel((rows + kBatch - 1) / kBatch, [&](std::size_t b) {
        const std::size_t size = std::min(kBatch, rows - b * kBatch);
        f(xs.rows_from(b * kBatch, size), fs.rows_from(b * kBatch, size));
      });
      add(xs, {weight.data(), rows}, fs);
    }
    iterations.push_back(end(run.adapt));
  }
  return Integral(std::move(iterations));
}

void Integrator::sample(Batch<double> x, std::span<double> weight) {
  // Independent ones: any number of them has both components in their right shares, a part of a sequence would not.
  const Points points = m_state->points(Points::Kind::independent, x.rows());
  m_state->draw(points, *m_state->learner.proposal(Points::kSecondShare), 0, x, weight);
}

void Integrator::weights(Batch<const double> x, std::span<double> weight) const {
  const std::size_t dims = m_state->bounds.size();
  WARPATH_CHECK_EQ(x.cols(), dims);
  WARPATH_CHECK_EQ(x.rows(), weight.size());
  const auto proposal = m_state->learner.proposal(Points::kSecondShare);
  parallel((x.rows() + kBatch - 1) / kBatch, [&](std::size_t b) {
    const std::size_t begin = b * kBatch, rows = std::min(kBatch, x.rows() - begin);
    Matrix<double> y(rows, dims);
    for (std::size_t i = 0; i < rows; ++i)
      for (std::size_t d = 0; d < dims; ++d) y(i, d) = m_state->to_unit(d, x(begin + i, d));
    const std::span<double> log_q = weight.subspan(begin, rows);
    proposal->log_density(y.batch(), log_q);
    for (std::size_t i = 0; i < rows; ++i)
      log_q[i] = m_state->holds(x.row(begin + i)) ? m_state->volume * std::exp(-log_q[i]) : HUGE_VAL;
  });
}

void Integrator::save(const std::filesystem::path& path) const {
  TensorFile file;
  std::vector<double> bounds;
  for (const Interval& i : m_state->bounds) bounds.insert(bounds.end(), {i.low, i.high});
  file.put<double>("bounds", {static_cast<std::int64_t>(m_state->bounds.size()), 2}, bounds);
  file.metadata()["kind"] = kKind;
  m_state->learner.proposal(Points::kSecondShare)->save(file, kPrefix);
  file.save(path);
}

Integrator Integrator::load(const std::filesystem::path& path, IntegratorSettings settings) {
  const TensorFile file = TensorFile::load(path);
  if (file.meta("kind") != kKind)
    throw FileError(fmt::format("{}: holds a \"{}\", not an integrator", path.string(), file.meta("kind")));
  const auto stored = file.get<double>("bounds");
  if (stored.shape.size() != 2 || stored.shape[1] != 2)
    throw FileError(fmt::format("{}: its bounds are not D x 2 numbers", path.string()));
  std::vector<Interval> bounds;
  for (std::size_t d = 0; 2 * d < stored.values.size(); ++d)
    bounds.push_back({stored.values[2 * d], stored.values[2 * d + 1]});
  auto proposal = load_proposal(file, kPrefix);
  if (proposal->dims() != static_cast<int>(bounds.size()))
    throw FileError(
        fmt::format("{}: {} bounds for a warp of {} dimensions", path.string(), bounds.size(), proposal->dims()));
  if (const std::string family = main_component(*proposal).family();
      settings.warp == "auto" && family != "uniform" && family != "grid" && family != "chain")
    settings.warp = family;
  Integrator integrator(std::move(bounds), std::move(settings));
  integrator.m_state->learner.start_from(std::move(proposal));
  return integrator;
}

}  // namespace warpath
