#include "warp/conditional_kdtree.h"

#include "family/family.h"
#include "family/load_as.h"
#include "train/conditional_kdtree_learner.h"

namespace warpath {
namespace {

std::unique_ptr<VertexLearner> make_learner(const TrainSettings& train, const LearnedScene& scene,
                                            const Layout& numbers, const VertexProposal*) {
  ConditionalKdTreeSettings settings = train.conditional_kdtree;
  settings.numbers = numbers;
  return std::make_unique<ConditionalKdTreeLearner>(settings, scene.film_width, scene.film_height, train.uniform_share);
}

}  // namespace

Family conditional_kdtree_family() {
  return {"conditional-kdtree", "kd-trees over the numbers of one vertex, given the place on the film",
          VertexFamily{.load = load_as<VertexProposal, ConditionalKdTree>, .make_learner = make_learner}};
}

}  // namespace warpath
