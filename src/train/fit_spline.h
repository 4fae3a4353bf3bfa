#pragma once
#include <cstdint>

#include "train/settings.h"
#include "train/training_data.h"

namespace warpath {

/// Fits a spline flow to examples, by the variance of the estimate or by maximum likelihood, with Adam, until the loss
/// over the examples held out (the last rows) no longer falls; hands out the weights that were best there. The same
/// bits for any number of threads. `init`: weights to start from; throws ConfigError unless it is a spline flow of the
/// same architecture. Ends with the best so far when g_interrupted is set; throws Interrupted if there is none yet.
Fit fit_spline(const TrainingSet& examples, const SplineSettings& settings, std::uint64_t seed,
               const Proposal* init = nullptr);

}  // namespace warpath
