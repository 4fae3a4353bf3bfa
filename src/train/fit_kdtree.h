#pragma once
#include <memory>

#include "train/settings.h"
#include "train/training_data.h"
#include "warp/kdtree.h"

namespace warpath {

/// Fits a kd-tree to examples that are weighted by g (those with g = 0 among them). With the target `mean` a leaf's
/// density is its mean of g, as in [GBBE18]; with `second_moment` it is sqrt(mean of g^2), which is what makes the
/// variance of f / q smallest among the densities on these leaves (the other numbers of a path make g noisy).
/// Every mean is drawn to its parent's as if by `shrink` x c^2 samples of that, c the coefficient of variation of the
/// target in the parent, and no leaf has less than 1e-3 of the mean density. The same tree for any number of threads.
std::shared_ptr<const KdTree> fit_kdtree(Examples examples, const KdTreeSettings& settings);

}  // namespace warpath
