#pragma once
#include <algorithm>
#include <cstddef>

namespace warpath {

/// The film cut into tiles several times over, each time shifted by another part of a tile: what a density is
/// conditioned on changes less at their borders if it is the mean over all of them.
struct FilmTiling {
  int columns = 1, rows = 1;  ///< tiles across the film
  int tilings = 1;

  /// Tiles of one tiling; those at the border are cut off.
  std::size_t tiles_of_one() const { return static_cast<std::size_t>((columns + 1) * (rows + 1)); }
  std::size_t tiles() const { return static_cast<std::size_t>(tilings) * tiles_of_one(); }
  /// The tile of the k-th tiling that a point of the film, in [0,1)^2, lies in.
  std::size_t tile(int k, float x, float y) const {
    const auto place = [&](float at, int count, int shift) {
      const float offset = static_cast<float>(shift % tilings) / static_cast<float>(tilings);
      return std::clamp(static_cast<int>(at * static_cast<float>(count) + offset), 0, count);
    };
    const int column = place(x, columns, k), row = place(y, rows, 2 * k);
    return static_cast<std::size_t>(k) * tiles_of_one() + static_cast<std::size_t>(row * (columns + 1) + column);
  }
};

}  // namespace warpath
