#include "warp/realnvp.h"

#include "family/flows.h"
#include "family/load_as.h"
#include "train/fit_realnvp.h"

namespace warpath {
namespace {

Fit fit(const ResampledExamples& examples, const TrainSettings& settings, const Proposal* init) {
  return fit_realnvp(examples, counting_on(settings.realnvp, settings.uniform_share), settings.seed, init);
}

JointFamily::Adapted adapt(Examples examples, bool tempered, std::uint64_t seed, const Warp* before) {
  return adapt_flow(examples, tempered, seed, before, RealNvpSettings(), fit_realnvp);
}

}  // namespace

Family realnvp_family() {
  return {"realnvp", "the normalising flow of Zheng and Zwicker 2019",
          JointFamily{.load = load_as<Proposal, RealNvp>,
                      .fit = FitToExamples{.fit = fit},
                      .most_dims = kMostFlowDims,
                      .adapt = adapt,
                      .is_flow = true}};
}

}  // namespace warpath
