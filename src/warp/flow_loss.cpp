#include "warp/flow_loss.h"

#include <algorithm>
#include <cmath>

#include "nn/simd.h"

namespace warpath {

double block_loss(const FlowObjective& objective, const double* log_q, const float* weight, const float* target,
                  float* d_log_q) {
  double loss = 0;
  for (std::size_t i = 0; i < nn::kBlock; ++i) {
    d_log_q[i] = weight[i];
    if (weight[i] == 0) continue;
    const double w = static_cast<double>(weight[i]);
    if (objective.loss == FlowTraining::Loss::likelihood) {
      loss -= w * log_q[i];
      continue;
    }
    const double q = (1 - objective.uniform) * std::exp(std::min(log_q[i], 700.0)), mixed = q + objective.uniform;
    const double term = std::min(static_cast<double>(target[i]) / mixed, kMostWeight * objective.scale);
    loss += w * term;
    d_log_q[i] *= static_cast<float>(term / objective.scale * (q / mixed));
  }
  return loss;
}

}  // namespace warpath
