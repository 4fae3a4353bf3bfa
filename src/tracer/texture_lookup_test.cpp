#include "tracer/texture_lookup.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/rng.h"

namespace warpath {
namespace {

// Filters and wrap modes are compared with Mitsuba in bsdf_mitsuba_test.cpp.

Image random_bytes(int width, int height, int channels, bool srgb) {
  Image image{width, height, channels, srgb, {}};
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width) * height * channels);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint8_t>(mix64(i + 1));
  image.pixels = pixels;
  return image;
}

BitmapTexture bitmap(Image image) { return {.image = std::make_shared<const Image>(std::move(image)), .to_uv = {}}; }

TEST(TextureLookup, BytesAndFloatsAgree) {
  const Image bytes = random_bytes(7, 5, 3, false);
  Image floats = bytes;
  std::vector<float> pixels;
  for (const std::uint8_t b : std::get<std::vector<std::uint8_t>>(bytes.pixels)) pixels.push_back(b / 255.0f);
  floats.pixels = pixels;
  const std::vector<Texture> textures{bitmap(bytes), bitmap(floats)};
  const TextureLookup lookup(textures);
  for (int i = 0; i < 200; ++i) {
    const std::uint64_t key = sample_key(3, i);
    const Vec2 uv(4 * sample_float(key, 0) - 2, 4 * sample_float(key, 1) - 2);
    const Color a = lookup.color(0, uv), b = lookup.color(1, uv);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 1e-6f);
    EXPECT_NEAR(lookup.scalar(0, uv), luminance(a), 1e-6f);
  }
  EXPECT_NEAR(lookup.mean(0), lookup.mean(1), 1e-6f);
}

TEST(TextureLookup, DecodesSrgb) {
  Image image{2, 2, 1, true, std::vector<std::uint8_t>{0, 10, 128, 255}};
  BitmapTexture t = bitmap(image);
  t.filter = BitmapTexture::Filter::nearest;
  const std::vector<Texture> textures{t};
  const TextureLookup lookup(textures);
  EXPECT_EQ(lookup.scalar(0, {0.25f, 0.25f}), 0);
  EXPECT_NEAR(lookup.scalar(0, {0.75f, 0.25f}), 10 / 255.0 / 12.92, 1e-7);
  EXPECT_NEAR(lookup.scalar(0, {0.25f, 0.75f}), 0.2158605, 1e-6);
  EXPECT_NEAR(lookup.scalar(0, {0.75f, 0.75f}), 1, 1e-6);
}

TEST(TextureLookup, GradientIsTheSlope) {
  BitmapTexture t = bitmap(random_bytes(6, 4, 1, false));
  // A turn, a stretch and a shift; row vectors.
  t.to_uv = Imath::M33f(1.2f, 0.7f, 0, -0.4f, 0.9f, 0, 0.1f, 0.2f, 1);
  const std::vector<Texture> textures{t};
  const TextureLookup lookup(textures);
  const Imath::M33f inverse = t.to_uv.inverse();
  for (int i = 0; i < 300; ++i) {
    // Well within a cell between four texel centres, where the look-up is bilinear.
    const std::uint64_t key = sample_key(5, i);
    const auto inside = [&](int d, int size) {
      return (std::floor(sample_float(key, d) * size) + 0.7f + 0.6f * sample_float(key, d + 1)) / size;
    };
    const Vec2 uv = Vec2(inside(0, 6), inside(2, 4)) * inverse;
    const float h = 5e-3f;
    const auto slope = [&](const Vec2& d) { return (lookup.scalar(0, uv + d) - lookup.scalar(0, uv - d)) / (2 * h); };
    const Vec2 g = lookup.gradient(0, uv);
    EXPECT_NEAR(g.x, slope({h, 0}), 1e-3f);
    EXPECT_NEAR(g.y, slope({0, h}), 1e-3f);
  }
}

TEST(TextureLookup, MeanIsTheAverageOverTheUnitSquare) {
  CheckerboardTexture board;
  const std::vector<Texture> textures{bitmap(random_bytes(8, 8, 3, true)), board,
                                      ConstantTexture{Color(0.1f, 0.2f, 0.6f)}};
  const TextureLookup lookup(textures);
  for (TextureId id = 0; id < 3; ++id) {
    double sum = 0;
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x) sum += lookup.scalar(id, {(x + 0.5f) / 64, (y + 0.5f) / 64});
    EXPECT_NEAR(lookup.mean(id), sum / 4096, 1e-5) << id;
  }
}

TEST(TextureLookup, AnyCoordinatesAreSafe) {
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  for (const auto wrap : {BitmapTexture::Wrap::repeat, BitmapTexture::Wrap::mirror, BitmapTexture::Wrap::clamp}) {
    for (const auto filter : {BitmapTexture::Filter::nearest, BitmapTexture::Filter::bilinear}) {
      BitmapTexture t = bitmap(random_bytes(3, 1, 3, true));
      t.wrap = wrap;
      t.filter = filter;
      const std::vector<Texture> textures{t};
      const TextureLookup lookup(textures);
      for (const float u : {1e30f, -1e30f, inf, -inf, nan, 1e9f, -1.5f}) {
        for (const float v : {0.0f, -1e20f, nan}) {
          const Color c = lookup.color(0, {u, v});
          for (int k = 0; k < 3; ++k) EXPECT_TRUE(c[k] >= 0 && c[k] <= 1) << u << ' ' << v;
        }
      }
    }
  }
}

}  // namespace
}  // namespace warpath
