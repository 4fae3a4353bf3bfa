#pragma once
#include <functional>

#include "train/training_data.h"

namespace warpath {

/// Told how many candidates are done, now and then, by one thread at a time.
using CandidateProgress = std::function<void(std::uint64_t done)>;

/// Evaluates `count` uniform primary samples. The target g is the luminance of three channels, else the mean of |f|.
/// Columns of y are numbers of the streams (seed, kFirstCandidate + id): an integrand of the same seed then traces
/// exactly the paths that a UniformSource would give it. All cores; the same for any number of threads.
/// keep_contributions keeps f itself too, for candidates that count in the image. `first` numbers the first
/// one, for candidates that are gathered in chunks. Throws Interrupted when g_interrupted
/// is set.
Candidates gather_candidates(const Integrand& integrand, const Layout& layout, std::uint64_t seed, std::uint64_t count,
                             const CandidateProgress& progress = {}, bool keep_contributions = false,
                             std::uint64_t first = 0);

}  // namespace warpath
