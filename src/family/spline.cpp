#include "warp/spline.h"

#include "family/flows.h"
#include "family/load_as.h"
#include "train/fit_spline.h"

namespace warpath {
namespace {

// Rows that a spline flow learns from, drawn from the candidates it has anyway: with fewer it soon knows them by heart.
constexpr std::uint64_t kMostRows = std::uint64_t{1} << 22;
// Brighter candidates teach it no more than this.
constexpr double kMostTarget = 3;

Fit fit(const ResampledExamples& examples, const TrainSettings& settings, const Proposal* init) {
  return fit_spline(examples, counting_on(settings.spline, settings.uniform_share), settings.seed, init);
}

std::uint64_t count(const TrainSettings& settings, std::uint64_t candidates) {
  return std::max(settings.examples, std::min(candidates, kMostRows));
}

JointFamily::Adapted adapt(Examples examples, bool tempered, std::uint64_t seed, const Warp* before) {
  SplineSettings settings;
  settings.masks = SplineSettings::Masks::autoregressive;
  if (examples.y.cols() <= 3) {  // several passes over few numbers, finely encoded, each by a small network
    settings.couplings = 3;
    settings.blocks = 0;
    settings.encoding_bins = 31;  // with the number itself 32 inputs, which fill the kernels
  } else {
    settings.couplings = 1;
    settings.encoding_bins = 8;
  }
  return adapt_flow(examples, tempered, seed, before, settings, fit_spline);
}

}  // namespace

Family spline_family() {
  return {"spline", "a flow of rational-quadratic splines (Durkan et al. 2019; Mueller et al. 2019)",
          JointFamily{.load = load_as<Proposal, Spline>,
                      .fit = FitToExamples{.fit = fit, .count = count, .most_target = kMostTarget},
                      .most_dims = kMostFlowDims,
                      .adapt = adapt,
                      .is_flow = true}};
}

}  // namespace warpath
