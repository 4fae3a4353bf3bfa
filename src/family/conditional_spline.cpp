#include "warp/conditional_spline.h"

#include "family/family.h"
#include "family/load_as.h"
#include "train/conditional_spline_learner.h"

namespace warpath {
namespace {

std::unique_ptr<VertexLearner> make_learner(const TrainSettings& train, const LearnedScene&, const Layout& numbers,
                                            const VertexProposal*) {
  ConditionalSplineSettings settings = train.conditional_spline;
  settings.numbers = numbers;
  return std::make_unique<ConditionalSplineLearner>(settings, train.uniform_share, train.seed);
}

}  // namespace

Family conditional_spline_family() {
  return {"conditional-spline", "spline flows over the numbers of vertices, given what the path knows there",
          VertexFamily{.load = load_as<VertexProposal, ConditionalSpline>, .make_learner = make_learner}};
}

}  // namespace warpath
