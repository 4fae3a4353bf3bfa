#include "estimate/film_positions.h"

namespace warpath {
namespace {

constexpr int kTile = 8;  // pixels along a side

}  // namespace

std::vector<std::uint32_t> tiled_pixels(int width, int height) {
  std::vector<std::uint32_t> pixels;
  pixels.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y0 = 0; y0 < height; y0 += kTile)
    for (int x0 = 0; x0 < width; x0 += kTile)
      for (int y = y0; y < std::min(height, y0 + kTile); ++y)
        for (int x = x0; x < std::min(width, x0 + kTile); ++x)
          pixels.push_back(static_cast<std::uint32_t>(y * width + x));
  return pixels;
}

}  // namespace warpath
