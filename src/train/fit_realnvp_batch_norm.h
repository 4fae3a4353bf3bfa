#pragma once
#include <cstddef>

#include "train/flow_optimiser.h"
#include "warp/realnvp_flow.h"

namespace warpath::realnvp {

/// The loss of Flow::train_block and its gradients over a whole batch, for flows with batch normalisation. Running
/// statistics in `parameters` are moved. gradients: `slots` arrays, parameter_count() apart, that sum up to them.
double batch_norm_step(const Flow& flow, const ExampleBlocks& batch, const FlowObjective& objective, float* parameters,
                       float* gradients, std::size_t slots);
/// The same as what an optimiser calls; the flow must outlive it.
FlowOptimiser::Pass batch_norm_pass(const Flow& flow);

}  // namespace warpath::realnvp
