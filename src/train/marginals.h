#pragma once
#include <cstdint>
#include <vector>

#include "train/training_data.h"
#include "warp/proposal.h"

namespace warpath {

/// Density over two of the dimensions, all others integrated out: `bins` x `bins` values whose mean is 1, row-major,
/// the first dimension to the right and the second down.
struct Marginal {
  int column_x = 0, column_y = 0;
  int bins = 0;
  std::vector<float> density;
};

/// What a proposal should follow: the candidates' histogram, weighted by the target.
Marginal target_marginal(const Candidates& candidates, int column_x, int column_y, int bins);
/// Where a proposal puts its samples: the histogram of `samples` of them.
Marginal proposal_marginal(const Proposal& proposal, int column_x, int column_y, int bins, std::uint64_t samples);

}  // namespace warpath
