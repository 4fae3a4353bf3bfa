#pragma once
#include <algorithm>

#include "core/log.h"
#include "family/family.h"

namespace warpath {

inline constexpr int kMostFlowDims = 32;

/// Fits a flow to the points of an Integrator's iterations, kEpochs times each, by `fit` (fit_realnvp or fit_spline).
template <class Settings, class FitFlow>
JointFamily::Adapted adapt_flow(const Examples& examples, bool tempered, std::uint64_t seed, const Warp* before,
                                Settings settings, const FitFlow& fit) {
  constexpr std::size_t kEpochs = 4;
  settings.loss = tempered ? FlowTraining::Loss::likelihood : FlowTraining::Loss::variance;
  settings.expected_uniform_share = 0.05;
  settings.average = 0.99;
  settings.max_steps =
      std::max(200, static_cast<int>(kEpochs * examples.size() / static_cast<std::size_t>(settings.batch)));
  const Fit result = fit(ExampleSet(examples), settings, seed, before);
  log::debug("flow: {} examples, loss {:.4g}, {}", examples.size(), result.log.points.back().held_out,
             result.log.stopped);
  return {std::dynamic_pointer_cast<const Warp>(result.proposal), result.log.points.back().samples};
}

/// The settings of a flow whose samples are mixed with a share of uniform ones.
template <class Settings>
Settings counting_on(Settings settings, double uniform_share) {
  settings.expected_uniform_share = uniform_share;
  return settings;
}

}  // namespace warpath
