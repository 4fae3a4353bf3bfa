#pragma once
#include <span>

#include "train/cell_draws.h"
#include "warp/halving_density.h"

namespace warpath {

/// Sums over the draws of a cell that fell into one bin of its density.
struct CellBin {
  float sum = 0;  ///< of f / q: over the draws of the cell and the bin's volume, the mean of f
  float draws = 0;
};

/// How much a cell's density believes.
struct CellBelief {
  double shrink;   ///< FieldSettings::shrink, above 0
  double trust;    ///< FieldSettings::trust
  double uniform;  ///< share of uniform numbers, if there is enough to learn from
};

/// The density of a cell over the numbers that `grid` halves, from what its n draws brought.
///
/// Node i of the tree of halvings, below p, has the volume v_i, d_i draws and the sum S_i of their f / q. Each half is
/// drawn to the whole that it is part of, the more the fewer draws it has seen, unless the two halves differ by more
/// than chance would have it: light through a gap stands out after a few hits. A hit is the f / q that a typical unit
/// of light comes with, h = sum (f / q)^2 / sum f / q; hits of the halves, if these were alike, would be binomial.
///
///   e_root = S_root / n,   e_i = b_i S_i / (n v_i) + (1 - b_i) e_p
///   b_i    = max(d_i / (d_i + shrink), 1 - 4 / X_i)
///   X_i    = S_p / h (S_i / S_p - r)^2 / (r (1 - r)),   r = v_i / v_p
///
/// The bound 4 on X_i, a chi-squared of one degree of freedom, is that of the positive part of the estimator of James
/// and Stein [JS61]; chance passes it in 1 of 20 nodes. With E the sum of e v over all bins, and the effective draws
/// m = (sum f / q)^2 / sum (f / q)^2,
///
///   density of bin i = 1 - s + s e_i / E,   s = (1 - uniform) m / (m + trust)
///
/// bins: one for each of the grid. masses: density times volume, for HalvingGrid::set_density. Returns s, the share of
/// what was learned; 0 where nothing came back.
double fit_cell_density(const HalvingGrid& grid, std::span<const CellBin> bins, const CellDraws& draws,
                        const CellBelief& belief, std::span<float> masses);

}  // namespace warpath
