#include "tracer/texture_lookup.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "warpath/error.h"

namespace warpath {

namespace {

/// Linear values of the 256 codes. [IEC 61966-2-1]
const std::array<float, 256>& decode_table(bool srgb) {
  static const auto tables = [] {
    std::array<std::array<float, 256>, 2> t;
    for (int i = 0; i < 256; ++i) {
      const double v = i / 255.0;
      t[0][i] = static_cast<float>(v);
      t[1][i] = static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
    }
    return t;
  }();
  return tables[srgb];
}

float mean_channel(const Color& c) { return (c.x + c.y + c.z) * (1 / 3.0f); }

int floor_to_int(float x) {
  // Clamped first: what is outside of int has no texel of its own, and NaN becomes the lower end.
  return static_cast<int>(std::floor(smaller(1e9f, larger(-1e9f, x))));
}

}  // namespace

TextureLookup::TextureLookup(std::span<const Texture> textures) {
  m_textures.reserve(textures.size());
  for (const Texture& texture : textures) {
    Compiled& t = m_textures.emplace_back();
    const auto set_transform = [&t](const Imath::M33f& m) {
      for (int i = 0; i < 3; ++i) {
        t.to_u[i] = m[i][0];
        t.to_v[i] = m[i][1];
      }
    };
    if (const auto* constant = std::get_if<ConstantTexture>(&texture)) {
      t.color0 = t.color1 = constant->value;
      t.scalar0 = t.scalar1 = mean_channel(t.color0);
    } else if (const auto* board = std::get_if<CheckerboardTexture>(&texture)) {
      t.type = Type::checkerboard;
      t.color0 = board->color0;
      t.color1 = board->color1;
      t.scalar0 = mean_channel(t.color0);
      t.scalar1 = mean_channel(t.color1);
      set_transform(board->to_uv);
    } else {
      const auto& bitmap = std::get<BitmapTexture>(texture);
      WARPATH_CHECK(bitmap.image != nullptr);
      const Image& image = *bitmap.image;
      WARPATH_CHECK(image.width > 0 && image.height > 0 && (image.channels == 1 || image.channels == 3));
      t.type = Type::bitmap;
      t.filter = bitmap.filter;
      t.wrap = bitmap.wrap;
      t.width = image.width;
      t.height = image.height;
      t.channels = image.channels;
      t.image = bitmap.image;
      t.decode = decode_table(image.srgb).data();
      const std::size_t count = static_cast<std::size_t>(image.width) * image.height * image.channels;
      if (const auto* bytes = std::get_if<std::vector<std::uint8_t>>(&image.pixels)) {
        WARPATH_CHECK_EQ(bytes->size(), count);
        t.bytes = bytes->data();
      } else {
        const auto& floats = std::get<std::vector<float>>(image.pixels);
        WARPATH_CHECK_EQ(floats.size(), count);
        t.floats = floats.data();
      }
      set_transform(bitmap.to_uv);
    }
  }
}

Vec2 TextureLookup::Compiled::transform(const Vec2& uv) const {
  return {uv.x * to_u[0] + uv.y * to_u[1] + to_u[2], uv.x * to_v[0] + uv.y * to_v[1] + to_v[2]};
}

// Where a texture repeats, the part of the position behind the point says the same, and wrap_to need not divide.
Vec2 TextureLookup::Compiled::place(const Vec2& uv) const {
  const Vec2 p = transform(uv);
  if (wrap != BitmapTexture::Wrap::repeat) return p;
  return {p.x - std::floor(p.x), p.y - std::floor(p.y)};
}

int TextureLookup::Compiled::wrap_to(int i, int size) const {
  if (static_cast<unsigned>(i) < static_cast<unsigned>(size)) return i;
  if (wrap == BitmapTexture::Wrap::clamp) return i < 0 ? 0 : size - 1;
  if (wrap == BitmapTexture::Wrap::repeat && i == size) return 0;
  if (wrap == BitmapTexture::Wrap::repeat && i == -1) return size - 1;
  const int period = wrap == BitmapTexture::Wrap::mirror ? 2 * size : size;
  int r = i % period;
  if (r < 0) r += period;
  return r < size ? r : period - 1 - r;
}

Color TextureLookup::Compiled::texel(int x, int y) const {
  const std::size_t first = (static_cast<std::size_t>(y) * width + x) * channels;
  if (bytes) {
    const std::uint8_t* p = bytes + first;
    return channels == 3 ? Color(decode[p[0]], decode[p[1]], decode[p[2]]) : Color(decode[p[0]]);
  }
  const float* p = floats + first;
  return channels == 3 ? Color(p[0], p[1], p[2]) : Color(p[0]);
}

TextureLookup::Compiled::Cell TextureLookup::Compiled::cell(const Vec2& position) const {
  const float x = position.x * static_cast<float>(width) - 0.5f, y = position.y * static_cast<float>(height) - 0.5f;
  const int ix = floor_to_int(x), iy = floor_to_int(y);
  return {wrap_to(ix, width),
          wrap_to(iy, height),
          wrap_to(ix + 1, width),
          wrap_to(iy + 1, height),
          clamp01(x - static_cast<float>(ix)),
          clamp01(y - static_cast<float>(iy))};
}

Color TextureLookup::varying_color(const Compiled& t, const Vec2& uv) {
  if (t.type == Type::checkerboard) {
    const Vec2 p = t.transform(uv);
    const bool right = p.x - std::floor(p.x) > 0.5f, lower = p.y - std::floor(p.y) > 0.5f;
    return right == lower ? t.color0 : t.color1;
  }
  const Vec2 p = t.place(uv);
  if (t.filter == BitmapTexture::Filter::nearest)
    return t.texel(t.wrap_to(floor_to_int(p.x * static_cast<float>(t.width)), t.width),
                   t.wrap_to(floor_to_int(p.y * static_cast<float>(t.height)), t.height));
  const auto c = t.cell(p);
  const Color top = t.texel(c.x0, c.y0) * (1 - c.wx) + t.texel(c.x1, c.y0) * c.wx;
  const Color bottom = t.texel(c.x0, c.y1) * (1 - c.wx) + t.texel(c.x1, c.y1) * c.wx;
  return top * (1 - c.wy) + bottom * c.wy;
}

float TextureLookup::varying_scalar(const Compiled& t, const Vec2& uv) {
  if (t.type == Type::checkerboard) {
    const Vec2 p = t.transform(uv);
    const bool right = p.x - std::floor(p.x) > 0.5f, lower = p.y - std::floor(p.y) > 0.5f;
    // Mitsuba 3.9 swaps the two where it wants one number: weights, opacities and roughnesses in its scenes mean that.
    return right == lower ? t.scalar1 : t.scalar0;
  }
  return luminance(varying_color(t, uv));
}

void TextureLookup::prefetch(TextureId id, const Vec2& uv) const {
  const Compiled& t = at(id);
  if (t.type != Type::bitmap) return;
  const Vec2 p = t.place(uv);
  const int x = t.wrap_to(floor_to_int(p.x * static_cast<float>(t.width) - 0.5f), t.width);
  const int y = floor_to_int(p.y * static_cast<float>(t.height) - 0.5f);
  for (const int row : {t.wrap_to(y, t.height), t.wrap_to(y + 1, t.height)}) {
    const std::size_t first = (static_cast<std::size_t>(row) * t.width + x) * t.channels;
    __builtin_prefetch(t.bytes ? static_cast<const void*>(t.bytes + first) : t.floats + first);
  }
}

Vec2 TextureLookup::gradient(TextureId id, const Vec2& uv) const {
  const Compiled& t = at(id);
  if (t.type != Type::bitmap || t.filter == BitmapTexture::Filter::nearest) return {0, 0};
  const auto c = t.cell(t.place(uv));
  const float f00 = luminance(t.texel(c.x0, c.y0)), f10 = luminance(t.texel(c.x1, c.y0));
  const float f01 = luminance(t.texel(c.x0, c.y1)), f11 = luminance(t.texel(c.x1, c.y1));
  const float dx = ((f10 - f00) * (1 - c.wy) + (f11 - f01) * c.wy) * static_cast<float>(t.width);
  const float dy = ((f01 - f00) * (1 - c.wx) + (f11 - f10) * c.wx) * static_cast<float>(t.height);
  return {t.to_u[0] * dx + t.to_v[0] * dy, t.to_u[1] * dx + t.to_v[1] * dy};
}

float TextureLookup::mean(TextureId id) const {
  const Compiled& t = at(id);
  if (t.type != Type::bitmap) return 0.5f * (t.scalar0 + t.scalar1);
  const std::size_t pixels = static_cast<std::size_t>(t.width) * t.height;
  double channel_mean[3]{};
  for (int c = 0; c < t.channels; ++c) {
    double sum = 0;
    if (t.bytes) {
      std::array<std::size_t, 256> counts{};
      for (std::size_t i = 0; i < pixels; ++i) ++counts[t.bytes[i * t.channels + c]];
      for (int code = 0; code < 256; ++code) sum += static_cast<double>(counts[code]) * t.decode[code];
    } else {
      for (std::size_t i = 0; i < pixels; ++i) sum += t.floats[i * t.channels + c];
    }
    channel_mean[c] = sum / static_cast<double>(pixels);
  }
  if (t.channels == 1) return static_cast<float>(channel_mean[0]);
  return luminance(Color(static_cast<float>(channel_mean[0]), static_cast<float>(channel_mean[1]),
                         static_cast<float>(channel_mean[2])));
}

}  // namespace warpath
