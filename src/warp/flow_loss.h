#pragma once
#include "warp/flow_settings.h"

namespace warpath {

/// What a step of training minimises, see FlowTraining::Loss.
struct FlowObjective {
  FlowTraining::Loss loss = FlowTraining::Loss::likelihood;
  double uniform = 0;  ///< variance only: q stands for (1 - uniform) q + uniform
  double scale = 1;    ///< variance only: about E[g / q]; the gradient is that of the loss over it
};

/// One example weighs no more in the gradient of the variance than so many average ones: rare bright paths would throw
/// the weights about.
inline constexpr double kMostWeight = 10;

/// The loss summed over one block: of weight[i] * -ln q_i, or of weight[i] * target[i] / q_i, each example's part of it
/// cut off at kMostWeight * scale. d_log_q: its derivative with respect to -ln q_i (divided by scale).
double block_loss(const FlowObjective& objective, const double* log_q, const float* weight, const float* target,
                  float* d_log_q);

}  // namespace warpath
