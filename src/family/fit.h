#pragma once
#include <cstdint>
#include <functional>

#include "family/family.h"

namespace warpath {

/// |T| = alpha |S|: how many candidates the settings ask for, for every family the same.
std::uint64_t candidate_count(const TrainSettings& settings);

/// Fits a joint family, and mixes it with the uniform proposal (unless settings.uniform_share is 0). `init`: a proposal
/// to start from, mixtures looked into; for flows and the grid. Where no candidate has any light the uniform proposal
/// comes back. Throws ConfigError for settings that make no sense, and Interrupted if nothing is learned yet when
/// g_interrupted is set.
Fit fit(const JointFamily& family, const Candidates& candidates, const TrainSettings& settings,
        const Proposal* init = nullptr);

/// Shows candidates to `take`, chunk by chunk, in their order.
using CandidateChunks = std::function<void(const std::function<void(const Candidates&)>& take)>;
/// Whether a family needs each candidate once, so that fit_in_chunks can fit it.
bool fits_in_chunks(const JointFamily& family);
/// The same for those, from `count` candidates that need not be in memory at once: each chunk is resampled as it comes.
/// Its time is that of resampling and fitting, without gathering.
Fit fit_in_chunks(const JointFamily& family, const Layout& layout, std::uint64_t count, const CandidateChunks& chunks,
                  const TrainSettings& settings, const Proposal* init = nullptr);

/// The joint family of that name. Throws ConfigError that suggests a similar one.
const JointFamily& joint_family(std::string_view name);

}  // namespace warpath
