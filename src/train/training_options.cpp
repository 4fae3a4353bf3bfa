#include "train/training_options.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "warpath/error.h"

namespace warpath {
namespace {

template <class T>
void give(const std::optional<T>& option, T& setting) {
  if (option) setting = *option;
}

/// Whether `value` is the second of the two names that `option` may have.
bool is_second(std::string_view option, const std::string& value, std::string_view first, std::string_view second) {
  if (value != first && value != second)
    throw ConfigError(fmt::format("{} is \"{}\", not {} or {}", option, value, first, second));
  return value == second;
}

}  // namespace

bool TrainingOptions::use_samples() const { return is_second("training_samples", training_samples, "discard", "use"); }

TrainSettings TrainingOptions::train_settings(std::uint64_t seed) const {
  TrainSettings result = settings;
  result.seed = seed;
  if (!(epp > 0)) throw ConfigError(fmt::format("epp is {}, not above 0", epp));
  result.examples = examples ? examples : static_cast<std::uint64_t>(std::llround(epp * 200 * 160));
  if (is_second("architecture", architecture, "default", "released")) {
    result.realnvp = released_realnvp();
  } else {
    give(couplings, result.realnvp.couplings);
    give(width, result.realnvp.width);
    give(blocks, result.realnvp.blocks);
    give(encoding_bins, result.realnvp.encoding_bins);
    give(rate, result.realnvp.rate);
  }
  for (SplineSettings* spline : {&result.spline, &result.conditional_spline.flow}) {
    give(couplings, spline->couplings);
    give(width, spline->width);
    give(blocks, spline->blocks);
    give(encoding_bins, spline->encoding_bins);
    give(bins, spline->bins);
    give(rate, spline->rate);
  }
  give(bins, result.grid.bins);
  const bool likelihood = is_second("loss", loss, "variance", "likelihood");
  for (FlowTraining* flow :
       std::initializer_list<FlowTraining*>{&result.realnvp, &result.spline, &result.conditional_spline.flow}) {
    give(batch, flow->batch);
    give(jitter, flow->jitter);
    give(max_steps, flow->max_steps);
    if (likelihood) flow->loss = FlowTraining::Loss::likelihood;
  }
  if (is_second("networks", networks, "shared", "separate")) result.realnvp.shared = false;
  if (is_second("masks", masks, "binary", "alternating")) result.realnvp.masks = RealNvpSettings::Masks::alternating;
  if (bn == "none") {
    result.realnvp.norm = RealNvpSettings::Norm::none;
  } else if (is_second("bn", bn, "actnorm", "batch")) {
    result.realnvp.norm = RealNvpSettings::Norm::batch;
  }
  result.kdtree.target = is_second("kdtree_target", kdtree_target, "mean", "rms")
                             ? KdTreeSettings::Target::second_moment
                             : KdTreeSettings::Target::mean;
  if (is_second("kdtree_split", kdtree_split, "best", "cyclic")) result.kdtree.split = KdTreeSettings::Split::cyclic;
  return result;
}

}  // namespace warpath
