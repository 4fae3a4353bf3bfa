#include <fmt/format.h>

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <numeric>

#include "warpath/error.h"
#include "warpath/integrator.h"

namespace warpath {
namespace {

double chi2_upper_tail(double chi2, int dof) {
  return dof < 1 ? 1.0 : boost::math::gamma_q(0.5 * dof, 0.5 * std::max(chi2, 0.0));
}

}  // namespace

double Iteration::sdev(std::size_t c) const { return std::sqrt(covariance[c * mean.size() + c]); }

Integral::Integral(std::vector<Iteration> iterations) : m_iterations(std::move(iterations)) {
  if (m_iterations.empty()) throw ConfigError("no iterations: nothing to combine");
  const std::size_t n = m_iterations.front().mean.size();
  const bool adapted = std::any_of(m_iterations.begin(), m_iterations.end() - 1, [](auto& i) { return i.adapted; });
  // An iteration whose points all gave the same value is exact, so far as it can tell: it alone counts, with its like.
  const bool exact =
      std::any_of(m_iterations.begin(), m_iterations.end(), [](auto& i) { return !(i.covariance[0] > 0); });
  for (const Iteration& i : m_iterations) {
    WARPATH_CHECK_EQ(i.mean.size(), n);
    const double points = static_cast<double>(i.neval);
    m_weights.push_back(!adapted ? points : exact ? (i.covariance[0] > 0 ? 0 : points) : 1 / i.covariance[0]);
  }
  const double sum = std::accumulate(m_weights.begin(), m_weights.end(), 0.0);
  for (double& w : m_weights) w /= sum;
  m_mean.assign(n, 0);
  m_covariance.assign(n * n, 0);
  for (std::size_t k = 0; k < m_iterations.size(); ++k) {
    for (std::size_t c = 0; c < n; ++c) m_mean[c] += m_weights[k] * m_iterations[k].mean[c];
    for (std::size_t c = 0; c < n * n; ++c)
      m_covariance[c] += m_weights[k] * m_weights[k] * m_iterations[k].covariance[c];
  }
}

double Integral::sdev(std::size_t c) const { return std::sqrt(m_covariance[c * count() + c]); }

double Integral::chi2(std::size_t c) const {
  // Iterations of a fixed warp share their variance per point, which all of them together know best.
  const std::size_t n = count();
  const bool fixed = std::none_of(m_iterations.begin(), m_iterations.end(), [](auto& i) { return i.adapted; });
  double pooled = 0;
  for (const Iteration& i : m_iterations)
    pooled += i.covariance[c * n + c] * static_cast<double>(i.neval) / static_cast<double>(m_iterations.size());
  double sum = 0;
  for (const Iteration& i : m_iterations) {
    const double variance = fixed ? pooled / static_cast<double>(i.neval) : i.covariance[c * n + c];
    if (variance > 0) sum += (i.mean[c] - m_mean[c]) * (i.mean[c] - m_mean[c]) / variance;
  }
  return sum;
}

double Integral::Q(std::size_t c) const { return chi2_upper_tail(chi2(c), dof()); }

std::uint64_t Integral::neval() const {
  std::uint64_t sum = 0;
  for (const Iteration& i : m_iterations) sum += i.neval;
  return sum;
}

std::uint64_t Integral::non_finite() const {
  std::uint64_t sum = 0;
  for (const Iteration& i : m_iterations) sum += i.non_finite;
  return sum;
}

bool Integral::converged(double rtol, double atol) const {
  for (std::size_t c = 0; c < count(); ++c)
    if (!(sdev(c) <= std::max(atol, rtol * std::abs(mean(c))))) return false;
  return true;
}

std::string with_error(double mean, double sdev) {
  if (!std::isfinite(mean) || !std::isfinite(sdev)) return fmt::format("{} +- {}", mean, sdev);
  if (sdev == 0) return fmt::format("{}(0)", mean);
  // Two digits of the error; 99.6 rounds up to 100, which are the same two digits one place higher.
  int place = static_cast<int>(std::floor(std::log10(sdev))) - 1;
  auto digits = static_cast<long>(std::lround(sdev / std::pow(10.0, place)));
  if (digits >= 100) digits = static_cast<long>(std::lround(sdev / std::pow(10.0, ++place)));
  const int size = mean == 0 ? place : static_cast<int>(std::floor(std::log10(std::abs(mean))));
  if (std::max(size, place) >= 6 || size < -4) {  // with an exponent that mean and error share
    const int exponent = std::max(size, place + 1);
    return fmt::format("{:.{}f}({})e{:+03d}", mean / std::pow(10.0, exponent), exponent - place, digits, exponent);
  }
  if (place >= 0) return fmt::format("{:.0f}({:.0f})", mean, static_cast<double>(digits) * std::pow(10.0, place));
  if (place == -1) return fmt::format("{:.1f}({:.1f})", mean, static_cast<double>(digits) / 10);
  return fmt::format("{:.{}f}({})", mean, -place, digits);
}

std::string Integral::summary() const {
  std::string text = "itn   integral        wgt average     chi2/dof        Q\n";
  text += "-------------------------------------------------------\n";
  std::vector<Iteration> so_far;
  for (const Iteration& i : m_iterations) {
    so_far.push_back(i);
    const Integral average(so_far);
    const double chi2_dof = average.dof() > 0 ? average.chi2() / average.dof() : 0;
    text += fmt::format("{:3}   {:<15} {:<15} {:8.2f} {:8.2f}\n", so_far.size(), with_error(i.mean[0], i.sdev()),
                        with_error(average.mean(), average.sdev()), chi2_dof, average.Q());
  }
  return text;
}

}  // namespace warpath
