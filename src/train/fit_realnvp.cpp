#include "train/fit_realnvp.h"

#include "core/rng.h"
#include "nn/actnorm.h"
#include "train/fit_realnvp_batch_norm.h"
#include "train/flow_trainer.h"
#include "warp/realnvp.h"
#include "warp/realnvp_kernels.h"
#include "warpath/error.h"

namespace warpath {

RealNvpSettings released_realnvp() {
  RealNvpSettings s;
  s.couplings = 12;
  s.width = 512;
  s.blocks = 8;
  s.rate = 1e-4;
  s.jitter = 0;
  s.encoding_bins = 0;
  s.shared = false;
  s.loss = RealNvpSettings::Loss::likelihood;
  s.masks = RealNvpSettings::Masks::alternating;
  s.norm = RealNvpSettings::Norm::batch;
  return s;
}

namespace {

using nn::kBlock;
using Floats = nn::AlignedVector<float>;

Floats start_from(const Proposal& init, const realnvp::Flow& flow) {
  const auto* warp = dynamic_cast<const RealNvp*>(&init);
  if (!warp) throw ConfigError(fmt::format("a {} cannot start the training of a realnvp", init.family()));
  const RealNvpSettings &a = warp->settings(), &b = flow.settings();
  const auto text = [](const RealNvpSettings& s, int dims) {
    return fmt::format("{}D, {} couplings x {}, {} blocks, {} bins, {}, {} masks, norm {}", dims, s.couplings, s.width,
                       s.blocks, s.encoding_bins, s.shared ? "shared" : "separate",
                       s.masks == RealNvpSettings::Masks::binary ? "binary" : "alternating", static_cast<int>(s.norm));
  };
  if (text(a, warp->dims()) != text(b, flow.dims()))
    throw ConfigError(fmt::format("the weights to start from are of a Real NVP of {}; this one has {}",
                                  text(a, warp->dims()), text(b, flow.dims())));
  return warp->parameters();
}

// Every coupling is the identity at the start, so that all of them see the examples themselves.
void initialise_norms(const realnvp::Flow& flow, const ExampleBlocks& batch, Floats& parameters) {
  const std::size_t blocks = batch.count;
  Floats v(blocks * batch.dims * kBlock);
  realnvp::logit(static_cast<int>(blocks * batch.dims), batch.y.data(), v.data());
  parallel(flow.couplings().size(), [&](std::size_t c) {
    const realnvp::Coupling& coupling = flow.couplings()[c];
    const std::size_t inputs = static_cast<std::size_t>(coupling.nets[0].inputs());
    Floats x(blocks * inputs * kBlock);
    for (std::size_t b = 0; b < blocks; ++b)
      flow.encode_kept(coupling, v.data() + b * batch.dims * kBlock, x.data() + b * inputs * kBlock);
    for (std::size_t n = 0; n < coupling.nets.size(); ++n)
      nn::initialise_actnorm(coupling.nets[n], static_cast<int>(blocks), x.data(),
                             parameters.data() + coupling.parameters[n]);
  });
}

}  // namespace

Fit fit_realnvp(const TrainingSet& examples, const RealNvpSettings& settings, std::uint64_t seed,
                const Proposal* init) {
  using Norm = RealNvpSettings::Norm;
  const realnvp::Flow flow(static_cast<int>(examples.dims()), settings);
  FlowTrainer trainer(flow, examples, settings, seed);
  Floats parameters = init ? start_from(*init, flow) : flow.initial(mix64(seed + 2));
  if (!init && settings.norm == Norm::actnorm) initialise_norms(flow, trainer.first_batch(), parameters);
  FlowTrainer::Result result =
      trainer.run(std::move(parameters), settings.norm == Norm::batch ? realnvp::batch_norm_pass(flow) : nullptr);
  return {std::make_shared<RealNvp>(flow, std::move(result.parameters)), std::move(result.log)};
}

}  // namespace warpath
