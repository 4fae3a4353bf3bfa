#pragma once
#include <cstdint>

#include "train/settings.h"
#include "train/training_data.h"

namespace warpath {

/// Fits a Real NVP to examples by maximum likelihood on the inverse [ZZ19], with Adam, until the likelihood of the
/// examples held out (the last rows) no longer rises; hands out the weights that were best there. The same bits for any
/// number of threads. `init`: weights to start from; throws ConfigError unless it is a Real NVP of the same
/// architecture. Ends with the best so far when g_interrupted is set; throws Interrupted if there is none yet.
Fit fit_realnvp(const TrainingSet& examples, const RealNvpSettings& settings, std::uint64_t seed,
                const Proposal* init = nullptr);

}  // namespace warpath
