#pragma once
#include <algorithm>
#include <vector>

#include "nn/dense.h"
#include "nn/residual_net.h"

namespace warpath {

/// A residual network in plain loops and doubles, for one sample: what the kernels are tested against. Its parameters
/// start at p[at]; normalisation by gains.
inline std::vector<double> reference_net(const nn::ResidualNet& net, const std::vector<double>& p, std::size_t at,
                                         const std::vector<double>& x) {
  const auto layer = [&](const nn::DenseLayer& l, const std::vector<double>& in) {
    std::vector<double> out(static_cast<std::size_t>(l.outputs));
    for (std::size_t o = 0; o < out.size(); ++o) {
      double sum = 0;
      for (std::size_t k = 0; k < in.size(); ++k)
        sum += p[at + l.weight + o * static_cast<std::size_t>(nn::padded_inputs(l.inputs)) + k] * in[k];
      out[o] = (l.normalised ? p[at + l.gain + o] : 1.0) * sum + p[at + l.bias + o];
    }
    return out;
  };
  const auto relu = [](std::vector<double> v) {
    for (double& e : v) e = std::max(e, 0.0);
    return v;
  };
  const auto& l = net.layers();
  if (l.size() == 1) return layer(l[0], x);
  std::vector<double> h = relu(layer(l[0], x));
  for (std::size_t i = 1; i + 2 < l.size(); i += 2) {
    std::vector<double> sum = layer(l[i + 1], relu(layer(l[i], h)));
    for (std::size_t j = 0; j < h.size(); ++j) sum[j] += h[j];
    h = relu(sum);
  }
  return layer(l.back(), h);
}

}  // namespace warpath
