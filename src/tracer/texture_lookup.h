#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/math.h"
#include "scene/texture.h"

namespace warpath {

/// A scene's textures, compiled for look-up as Mitsuba 3 does it: row 0 of an image is at v = 0, pixel centres are at
/// (i + 0.5) / n, 8-bit values are decoded before they are interpolated. Immutable, thread-safe.
class TextureLookup {
 public:
  TextureLookup() = default;
  explicit TextureLookup(std::span<const Texture> textures);  ///< shares the images

  std::size_t size() const { return m_textures.size(); }
  bool is_constant(TextureId id) const { return at(id).type == Type::constant; }

  Color color(TextureId id, const Vec2& uv) const {
    const Compiled& t = at(id);
    return t.type == Type::constant ? t.color0 : varying_color(t, uv);
  }
  /// One number: a constant's mean, an image's luminance.
  float scalar(TextureId id, const Vec2& uv) const {
    const Compiled& t = at(id);
    return t.type == Type::constant ? t.scalar0 : varying_scalar(t, uv);
  }
  /// Starts loading the texels that a look-up at uv will read.
  void prefetch(TextureId id, const Vec2& uv) const;
  /// Change of scalar() with u and v; 0 unless interpolated.
  Vec2 gradient(TextureId id, const Vec2& uv) const;
  /// Average over the image or pattern.
  float mean(TextureId id) const;

 private:
  enum class Type : std::uint8_t { constant, checkerboard, bitmap };
  struct Compiled {
    Type type = Type::constant;
    BitmapTexture::Filter filter{};
    BitmapTexture::Wrap wrap{};
    int width = 0, height = 0, channels = 0;
    const std::uint8_t* bytes = nullptr;  ///< 8-bit pixels, or
    const float* floats = nullptr;
    const float* decode = nullptr;  ///< 8-bit value to linear
    Color color0, color1;
    float scalar0 = 0, scalar1 = 0;
    float to_u[3]{1, 0, 0}, to_v[3]{0, 1, 0};  ///< texture coordinates from (u, v, 1)
    std::shared_ptr<const Image> image;

    Vec2 transform(const Vec2& uv) const;
    Vec2 place(const Vec2& uv) const;  ///< on the image
    Color texel(int x, int y) const;
    int wrap_to(int i, int size) const;
    struct Cell {
      int x0, y0, x1, y1;
      float wx, wy;
    };
    Cell cell(const Vec2& position) const;
  };

  const Compiled& at(TextureId id) const { return m_textures[static_cast<std::size_t>(id)]; }
  static Color varying_color(const Compiled& t, const Vec2& uv);
  static float varying_scalar(const Compiled& t, const Vec2& uv);

  std::vector<Compiled> m_textures;
};

}  // namespace warpath
