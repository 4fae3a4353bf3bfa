#pragma once
#include <cstdint>
#include <functional>
#include <string>

#include "train/settings.h"
#include "train/training_data.h"

namespace warpath {

/// |T| = alpha |S|: how many candidates the settings ask for, for every family the same.
std::uint64_t candidate_count(const TrainSettings& settings);

/// Fits the family that the settings name, and mixes it with the uniform proposal (unless settings.uniform is 0). Real
/// NVP learns from settings.examples resampled candidates, a spline flow from as many as there are candidates (4 M at
/// most, or settings.examples if that is more), the others from all candidates, weighted. `init`: a proposal to start
/// from, mixtures looked into; for flows and the grid. Where no candidate has any light the uniform proposal comes
/// back. Throws ConfigError for settings that make no sense, and Interrupted if nothing is learned yet when
/// g_interrupted is set.
Fit train(const Candidates& candidates, const TrainSettings& settings, const Proposal* init = nullptr);

/// Shows candidates to `take`, chunk by chunk, in their order.
using CandidateChunks = std::function<void(const std::function<void(const Candidates&)>& take)>;
/// Whether a family needs each candidate once, so that train_in_chunks can fit it.
bool trains_in_chunks(const std::string& family);
/// The same for flows, from `count` candidates that need not be in memory at once: each chunk is resampled as it comes.
/// Its time is that of resampling and fitting, without gathering.
Fit train_in_chunks(const Layout& layout, std::uint64_t count, const CandidateChunks& chunks,
                    const TrainSettings& settings, const Proposal* init = nullptr);

}  // namespace warpath
