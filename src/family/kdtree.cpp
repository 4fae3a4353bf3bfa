#include "warp/kdtree.h"

#include "family/family.h"
#include "family/load_as.h"
#include "train/fit_kdtree.h"
#include "warpath/error.h"

namespace warpath {
namespace {

std::shared_ptr<const Proposal> fit(Examples examples, const TrainSettings& settings, const Proposal* init) {
  if (init) throw ConfigError("a kd-tree cannot start from a trained warp");
  return fit_kdtree(std::move(examples), settings.kdtree);
}

JointFamily::Adapted adapt(Examples examples, bool tempered, std::uint64_t, const Warp*) {
  KdTreeSettings settings;
  if (!tempered) settings.target = KdTreeSettings::Target::second_moment;
  return {fit_kdtree(std::move(examples), settings)};
}

}  // namespace

Family kdtree_family() {
  return {"kdtree", "the adaptive kd-tree of Guo et al. 2018",
          JointFamily{.load = load_as<Proposal, KdTree>,
                      .fit = FitToCandidates(fit),
                      .most_dims = KdTree::kMaxDims,
                      .adapt = adapt}};
}

}  // namespace warpath
