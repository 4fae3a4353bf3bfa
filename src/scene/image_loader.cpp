#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imageio.h>

#include <cmath>
#include <stdexcept>

#include "scene/loader.h"
#include "scene/srgb.h"

namespace warpath {
namespace {

namespace fs = std::filesystem;

/// Reads the first 1 or 3 channels of an image's first part. Alpha is dropped, and colours are never multiplied by it.
void read_image(const fs::path& file, bool raw, bool as_float_rgb, Image& image) {
  OIIO::ImageSpec config;
  config["oiio:UnassociatedAlpha"] = 1;
  const auto input = OIIO::ImageInput::open(file.string(), &config);
  if (!input) throw std::runtime_error(fmt::format("{}: {}", file.string(), OIIO::geterror()));
  const OIIO::ImageSpec& spec = input->spec();
  if (spec.depth > 1 || spec.width <= 0 || spec.height <= 0)
    throw std::runtime_error(fmt::format("{}: is no flat image", file.string()));

  image.width = spec.width;
  image.height = spec.height;
  const bool grey = spec.nchannels < 3;
  image.channels = grey ? 1 : 3;
  const bool is_integer = !spec.format.is_floating_point();
  const auto count = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) *
                     static_cast<std::size_t>(image.channels);
  const auto read = [&](OIIO::TypeDesc type, void* target) {
    if (!input->read_image(0, 0, 0, image.channels, type, target))
      throw std::runtime_error(fmt::format("{}: {}", file.string(), input->geterror()));
  };
  image.srgb = is_integer && !raw;
  if (spec.format == OIIO::TypeDesc::UINT8 && !as_float_rgb) {
    std::vector<std::uint8_t> pixels(count);
    read(OIIO::TypeDesc::UINT8, pixels.data());
    image.pixels = std::move(pixels);
    return;
  }
  std::vector<float> pixels(count);
  read(OIIO::TypeDesc::FLOAT, pixels.data());
  if (image.srgb)
    for (float& value : pixels) value = srgb_to_linear(value);
  image.srgb = false;  // float pixels are linear
  for (const float value : pixels)
    if (!std::isfinite(value)) throw std::runtime_error(fmt::format("{}: a pixel is not finite", file.string()));
  if (as_float_rgb && grey) {
    std::vector<float> rgb(3 * count);
    for (std::size_t i = 0; i < rgb.size(); ++i) rgb[i] = pixels[i / 3];
    pixels = std::move(rgb);
    image.channels = 3;
  }
  image.pixels = std::move(pixels);
}

}  // namespace

std::shared_ptr<const Image> LoadContext::texture_image(const Location& where, const fs::path& file, bool raw) {
  std::error_code error;
  auto& image = m_images[fs::weakly_canonical(file, error).string() + (raw ? ":raw" : ":colour")];
  if (!image) {
    image = std::make_shared<Image>();
    add_job(where, file, [file, raw, target = image] { read_image(file, raw, false, *target); });
  }
  return image;
}

std::shared_ptr<const Image> LoadContext::environment_image(const Location& where, const fs::path& file) {
  std::error_code error;
  auto& image = m_images[fs::weakly_canonical(file, error).string() + ":environment"];
  if (!image) {
    image = std::make_shared<Image>();
    add_job(where, file, [file, target = image] { read_image(file, false, true, *target); });
  }
  return image;
}

}  // namespace warpath
