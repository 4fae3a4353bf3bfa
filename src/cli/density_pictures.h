#pragma once
#include <vector>

#include "render/renderer.h"
#include "report/html.h"

namespace warpath {

/// Where a joint warp puts its samples, beside where its candidates say that it should: a picture for each group of its
/// numbers. None for other methods.
std::vector<DensityPicture> density_pictures(const Method& method, const Preparation& preparation);

}  // namespace warpath
