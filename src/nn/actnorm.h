#pragma once
#include "nn/residual_net.h"

namespace warpath::nn {

/// Sets gains and biases so that what goes into every ReLU has mean 0 and variance 1 over the given blocks (Kingma and
/// Dhariwal 2018). x: blocks x inputs x kBlock. Does nothing if the network is not normalised.
void initialise_actnorm(const ResidualNet& net, int blocks, const float* x, float* parameters);

}  // namespace warpath::nn
