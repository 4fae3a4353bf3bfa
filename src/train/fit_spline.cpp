#include "train/fit_spline.h"

#include "core/rng.h"
#include "train/flow_trainer.h"
#include "warp/spline.h"
#include "warpath/error.h"

namespace warpath {
namespace {

nn::AlignedVector<float> start_from(const Proposal& init, const spline::Flow& flow) {
  const auto* warp = dynamic_cast<const Spline*>(&init);
  if (!warp) throw ConfigError(fmt::format("a {} cannot start the training of a spline", init.family()));
  const auto text = [](const spline::Flow& f) {
    const SplineSettings& s = f.settings();
    const bool binary = s.masks == SplineSettings::Masks::binary;
    return fmt::format("{}D, {} {} x {}, {} blocks, {} bins, {} encoding bins", f.dims(), s.couplings,
                       binary ? "couplings" : "autoregressive layers", s.width, s.blocks, s.bins, s.encoding_bins);
  };
  if (text(warp->flow()) != text(flow))
    throw ConfigError(fmt::format("the weights to start from are of a spline flow of {}; this one has {}",
                                  text(warp->flow()), text(flow)));
  return warp->parameters();
}

}  // namespace

Fit fit_spline(const TrainingSet& examples, const SplineSettings& settings, std::uint64_t seed, const Proposal* init) {
  const spline::Flow flow(static_cast<int>(examples.dims()), settings);
  FlowTrainer trainer(flow, examples, settings, seed);
  FlowTrainer::Result result = trainer.run(init ? start_from(*init, flow) : flow.initial(mix64(seed + 2)));
  return {std::make_shared<Spline>(flow, std::move(result.parameters)), std::move(result.log)};
}

}  // namespace warpath
