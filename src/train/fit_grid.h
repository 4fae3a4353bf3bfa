#pragma once
#include <memory>

#include "train/settings.h"
#include "train/training_data.h"
#include "warp/grid.h"

namespace warpath {

/// Fits VEGAS's separable map (Lepage 1978) to weighted examples. One set of them serves all iterations: in each, every
/// example counts with g^2 / q of the map so far (or, with Target::mean, g), as if the map had drawn it. Starts from
/// `init`, or the identity, and hands out the map with the least second moment of g / q. The same for any number of
/// threads.
std::shared_ptr<const Grid> fit_grid(const Examples& examples, const GridSettings& settings,
                                     const Grid* init = nullptr);

/// The same map with every interval cut in two.
Grid halved(const Grid& grid);

}  // namespace warpath
