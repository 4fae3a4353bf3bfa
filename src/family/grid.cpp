#include "warp/grid.h"

#include <fmt/format.h>

#include "family/family.h"
#include "family/load_as.h"
#include "train/fit_grid.h"
#include "warp/load.h"
#include "warpath/error.h"

namespace warpath {
namespace {

std::shared_ptr<const Proposal> fit(Examples examples, const TrainSettings& settings, const Proposal* init) {
  const auto* grid = dynamic_cast<const Grid*>(init);
  if (init && !grid) throw ConfigError(fmt::format("a grid cannot start from a warp of family {}", init->family()));
  return fit_grid(examples, settings.grid, grid);
}

}  // namespace

Family grid_family() {
  return {"grid", "VEGAS's separable map",
          JointFamily{.load = load_as<Proposal, Grid>, .fit = FitToCandidates(fit), .most_dims = kMaxDims}};
}

}  // namespace warpath
