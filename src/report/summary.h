#pragma once
#include <string>
#include <vector>

#include "report/results.h"

namespace warpath {

/// A method's runs in one: means over runs with their standard errors.
struct MethodSummary {
  std::string method;
  std::vector<const MethodRun*> runs;  ///< into the comparison that was summarised
  Estimate mse, relmse, relmse_trimmed, mape;
  Estimate gain_mse, gain_relmse, gain_relmse_trimmed;  ///< the baseline's mean error over this method's
  Estimate gain_equal_time;  ///< gain_mse at equal total time, all training counted, if error falls as 1 / time
  Estimate spp, training_seconds, warp_seconds, trace_seconds, total_seconds;  ///< training: candidates and fitting
  std::uint64_t non_finite = 0;                                                ///< over all runs

  bool has_errors() const { return !std::isnan(mse.value); }
};

struct Summary {
  std::vector<MethodSummary> methods;  ///< in the order in which they were typed
  std::size_t baseline = 0;            ///< what gains are over: `none`, or the first method where there is no `none`
  std::size_t max_runs = 0;
  bool has_errors = false;  ///< some method has an MSE
};

/// The comparison must outlive the summary.
Summary summarise(const Comparison& comparison);

/// A number with the digits that it can answer for: up to the second digit of its standard error where that starts with
/// a 1 or 2, else up to the first; three significant digits where the error is not known. `error` is empty then.
/// "0.0192" and "0.0003"; "–" for NaN.
struct FormattedEstimate {
  std::string value;
  std::string error;
};
FormattedEstimate format_estimate(const Estimate& estimate);

/// "0.42 s", "12.3 s", "4 min 07 s".
std::string format_seconds(double seconds);

/// The table for a terminal: one row for each method, columns aligned at the decimal point; ends with a newline.
std::string results_table(const Comparison& comparison);

}  // namespace warpath
