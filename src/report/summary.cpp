#include "report/summary.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "warpath/error.h"

namespace warpath {
namespace {

template <class Field>
std::vector<double> values_of(const MethodSummary& summary, Field&& field) {
  std::vector<double> values;
  for (const MethodRun* run : summary.runs) values.push_back(static_cast<double>(std::invoke(field, *run)));
  return values;
}

template <class Field>
Estimate mean_of(const MethodSummary& summary, Field&& field) {
  return mean_over_runs(values_of(summary, field));
}

template <class Field>
Estimate gain_of(const MethodSummary& baseline, const MethodSummary& summary, Field&& field) {
  if (&baseline == &summary) {
    const double mean = mean_of(summary, field).value;
    return {mean > 0 ? 1.0 : kUnknown, 0.0};
  }
  return gain(values_of(baseline, field), values_of(summary, field));
}

std::vector<MethodSummary> group_by_method(const Comparison& comparison) {
  std::vector<MethodSummary> methods;
  for (const MethodRun& run : comparison.results) {
    auto found = std::find_if(methods.begin(), methods.end(), [&](const auto& m) { return m.method == run.method; });
    if (found == methods.end()) {
      methods.emplace_back().method = run.method;
      found = std::prev(methods.end());
    }
    found->runs.push_back(&run);
    found->non_finite += run.non_finite;
  }
  return methods;
}

}  // namespace

Summary summarise(const Comparison& comparison) {
  Summary summary;
  summary.methods = group_by_method(comparison);
  if (summary.methods.empty()) return summary;
  const auto none =
      std::find_if(summary.methods.begin(), summary.methods.end(), [](const auto& m) { return m.method == "none"; });
  if (none != summary.methods.end()) summary.baseline = none - summary.methods.begin();
  const MethodSummary& baseline = summary.methods[summary.baseline];

  for (MethodSummary& m : summary.methods) {
    summary.max_runs = std::max(summary.max_runs, m.runs.size());
    m.mse = mean_of(m, &MethodRun::mse);
    m.relmse = mean_of(m, &MethodRun::relmse);
    m.relmse_trimmed = mean_of(m, &MethodRun::relmse_trimmed);
    m.mape = mean_of(m, &MethodRun::mape);
    m.spp = mean_of(m, &MethodRun::spp);
    m.training_seconds = mean_of(m, [](const MethodRun& r) { return r.candidate_seconds + r.train_seconds; });
    m.warp_seconds = mean_of(m, &MethodRun::warp_seconds);
    m.trace_seconds = mean_of(m, &MethodRun::trace_seconds);
    m.total_seconds = mean_of(m, &MethodRun::total_seconds);
    m.gain_mse = gain_of(baseline, m, &MethodRun::mse);
    m.gain_relmse = gain_of(baseline, m, &MethodRun::relmse);
    m.gain_relmse_trimmed = gain_of(baseline, m, &MethodRun::relmse_trimmed);
    m.gain_equal_time = gain_of(baseline, m, [](const MethodRun& r) { return r.mse * r.total_seconds; });
    summary.has_errors = summary.has_errors || m.has_errors();
  }
  return summary;
}

FormattedEstimate format_estimate(const Estimate& estimate) {
  const double value = estimate.value;
  if (!std::isfinite(value)) return {"–", ""};
  // The power of ten of the last digit that is shown.
  const auto exponent = [](double x) { return static_cast<int>(std::floor(std::log10(std::abs(x)))); };
  const double error = estimate.standard_error;
  int last = value == 0 ? 0 : exponent(value) - 2;
  const bool has_error = std::isfinite(error) && error > 0;
  if (has_error) {
    last = exponent(error);
    if (error < 3 * std::pow(10.0, last)) --last;
  } else if (error == 0 && value == std::round(value)) {
    last = 0;  // exact
  }
  const int decimals = std::max(0, -last);
  if (decimals > 9)
    return has_error ? FormattedEstimate{fmt::format("{:.2e}", value), fmt::format("{:.0e}", error)}
                     : FormattedEstimate{fmt::format("{:.2e}", value), ""};
  return {fmt::format("{:.{}f}", value, decimals), has_error ? fmt::format("{:.{}f}", error, decimals) : ""};
}

std::string format_seconds(double seconds) {
  if (!std::isfinite(seconds)) return "–";
  if (seconds < 10) return fmt::format("{:.2f} s", seconds);
  if (seconds < 100) return fmt::format("{:.1f} s", seconds);
  const long whole = std::lround(seconds);
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

}  // namespace warpath
