#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/math.h"

namespace warpath {

/// A linear Rec. 709 image: `pixels[y * width + x]`, from the top left, row by row.
struct ImageRgb {
  int width = 0;
  int height = 0;
  std::vector<Color> pixels;

  ImageRgb() = default;
  ImageRgb(int columns, int rows, Color fill = Color(0.0f))
      : width(columns),
        height(rows),
        pixels(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), fill) {}

  Color& at(int x, int y) { return pixels[static_cast<std::size_t>(y) * width + x]; }
  const Color& at(int x, int y) const { return pixels[static_cast<std::size_t>(y) * width + x]; }
  bool empty() const { return pixels.empty(); }
};

/// What an image file tells about itself: scene, method, samples, ...
using ImageAttribute = std::variant<int, float, std::string>;

/// One more channel of an image file, one float a pixel in the image's order; `name` is `layer.channel`.
struct ImageChannel {
  std::string name;
  std::vector<float> values;
};

/// An image with all that its file holds beside R, G and B.
struct ImageFile {
  ImageRgb image;
  std::vector<ImageChannel> channels;
  std::map<std::string, ImageAttribute> attributes;

  /// Adds `layer.R`, `layer.G`, `layer.B`, or under other letters ("XYZ" for normals). Same size as `image`.
  void add_layer(std::string_view layer, const ImageRgb& values, std::string_view letters = "RGB");
  /// Adds the single channel `layer.Y`: counts, depths. Same size as `image`.
  void add_layer(std::string_view layer, std::span<const float> values);
  /// The three channels of a layer, if the file has them all.
  std::optional<ImageRgb> layer(std::string_view layer, std::string_view letters = "RGB") const;
};

/// Throws ConfigError unless `path` ends in .exr, .png, .jpg or .jpeg (any case): call it before hours of rendering.
void check_image_name(const std::filesystem::path& path);

/// Writes whole or not at all. EXR: float32, ZIP, every channel and attribute. PNG and JPEG: R, G, B alone, 8 bits
/// under the sRGB curve, values beyond [0,1] clipped, NaN as 0. Throws ConfigError for other endings, FileError with
/// the system's reason.
void write_image(const std::filesystem::path& path, const ImageFile& file);
void write_image(const std::filesystem::path& path, const ImageRgb& image);

/// Reads the first part of any file that OpenImageIO knows; files of 8 or 16 bits are taken for sRGB and made linear. A
/// single channel Y becomes grey. Throws FileError where there is no such file, no R, G, B or Y, or where it breaks
/// off.
ImageFile read_image(const std::filesystem::path& path);

/// The image that others are measured against, and the variance of its pixels' means where that is known.
struct Reference {
  std::filesystem::path path;
  ImageRgb image;
  std::optional<ImageRgb> variance;
};

/// Reads `ref.exr` and, for its variance, `ref.variance.exr` beside it or else the layer `variance` in `ref.exr`
/// itself. Throws FileError if sizes differ (from each other, or from `width` x `height` unless these are 0) or a pixel
/// is not finite.
Reference read_reference(const std::filesystem::path& path, int width = 0, int height = 0);

/// The sRGB curve (IEC 61966-2-1) over [0,1], and back; values beyond are clipped.
float linear_to_srgb(float x);
float srgb_to_linear(float x);

}  // namespace warpath
