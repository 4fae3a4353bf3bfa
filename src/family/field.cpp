#include "warp/field.h"

#include <fmt/format.h>

#include "family/family.h"
#include "family/load_as.h"
#include "train/field_learner.h"
#include "warpath/error.h"

namespace warpath {
namespace {

std::unique_ptr<VertexLearner> make_learner(const TrainSettings& train, const LearnedScene& scene,
                                            const Layout& numbers, const VertexProposal* init) {
  FieldSettings settings = train.field;
  settings.numbers = numbers;
  auto learner = std::make_unique<FieldLearner>(settings, scene.emitters);
  if (init) {
    const auto* field = dynamic_cast<const Field*>(init);
    if (!field) throw ConfigError(fmt::format("a field cannot start from a {}", init->family()));
    learner->start_from(*field);
  }
  return learner;
}

}  // namespace

Family field_family() {
  return {
      "field", "densities at every vertex, in cells of world space, that learn while they render",
      VertexFamily{
          .load = load_as<VertexProposal, Field>, .make_learner = make_learner, .every_vertex = true, .goes_on = true}};
}

}  // namespace warpath
