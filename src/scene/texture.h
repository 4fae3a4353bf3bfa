#pragma once
#include <Imath/ImathMatrix.h>

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "core/math.h"

namespace warpath {

/// Pixels as they were stored, so that a scene costs the memory of its files: 8-bit values are decoded (sRGB or linear)
/// when they are looked up.
struct Image {
  int width = 0, height = 0, channels = 0;  ///< 1 or 3 channels; row 0 is the top of the picture
  bool srgb = false;                        ///< 8-bit values carry the sRGB curve
  std::variant<std::vector<std::uint8_t>, std::vector<float>> pixels;  ///< 8-bit: value / 255
};

struct ConstantTexture {
  Color value{0.5f};
};
struct BitmapTexture {
  enum class Filter : std::uint8_t { nearest, bilinear };
  enum class Wrap : std::uint8_t { repeat, mirror, clamp };
  std::shared_ptr<const Image> image;
  Filter filter = Filter::bilinear;
  Wrap wrap = Wrap::repeat;
  Imath::M33f to_uv;  ///< Imath's row-vector convention: (u, v, 1) * to_uv
};
struct CheckerboardTexture {
  Color color0{0.4f}, color1{0.2f};
  Imath::M33f to_uv;
};

using Texture = std::variant<ConstantTexture, BitmapTexture, CheckerboardTexture>;
using TextureId = std::int32_t;  ///< index into Scene::textures

}  // namespace warpath
