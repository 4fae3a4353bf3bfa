#include "report/image.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "core/file.h"
#include "warpath/error.h"

namespace warpath {
namespace {

namespace fs = std::filesystem;
static_assert(sizeof(Color) == 3 * sizeof(float), "pixels are handed to OpenImageIO as they lie in memory");

enum class Format { exr, png, jpeg, unknown };

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension;
}

Format format_of(const fs::path& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".exr") return Format::exr;
  if (extension == ".png") return Format::png;
  if (extension == ".jpg" || extension == ".jpeg") return Format::jpeg;
  return Format::unknown;
}

/// Encodes in memory: a full disk is then met in write_atomically alone, which knows the system's reason. rows(begin,
/// end) gives those rows of the image, as they lie one behind the other.
template <class Rows>
std::string encode(const fs::path& path, const OIIO::ImageSpec& spec, OIIO::TypeDesc type, const Rows& rows) {
  OIIO::Filesystem::IOVecOutput buffer;
  const auto fail = [&](const std::string& reason) {
    throw FileError(fmt::format("{}: cannot encode: {}", path.string(), reason));
  };
  const auto output = OIIO::ImageOutput::create(path.string(), &buffer);
  if (!output) fail(OIIO::geterror());
  bool good = output->open(path.string(), spec);
  constexpr int kRows = 64;  // a multiple of what OpenEXR compresses together
  for (int y = 0; good && y < spec.height; y += kRows) {
    const int end = std::min(spec.height, y + kRows);
    good = output->write_scanlines(y, end, 0, type, rows(y, end).data());
  }
  if (!good || !output->close()) fail(output->geterror());
  const auto& bytes = buffer.buffer();
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

std::string encode_exr(const fs::path& path, const ImageFile& file) {
  const std::size_t pixel_count = file.image.pixels.size();
  const int channel_count = 3 + static_cast<int>(file.channels.size());
  OIIO::ImageSpec spec(file.image.width, file.image.height, channel_count, OIIO::TypeDesc::FLOAT);
  spec.channelnames = {"R", "G", "B"};
  for (const ImageChannel& channel : file.channels) {
    WARPATH_CHECK_EQ(channel.values.size(), pixel_count);
    spec.channelnames.push_back(channel.name);
  }
  spec.attribute("compression", "zip");
  spec.attribute("oiio:ColorSpace", "Linear");
  for (const auto& [name, value] : file.attributes)
    std::visit([&, &name = name](const auto& v) { spec.attribute(name, v); }, value);

  return encode(path, spec, OIIO::TypeDesc::FLOAT, [&](int begin, int end) {
    const std::size_t width = static_cast<std::size_t>(file.image.width);
    std::vector<float> values;
    values.reserve(static_cast<std::size_t>(end - begin) * width * static_cast<std::size_t>(channel_count));
    for (std::size_t i = static_cast<std::size_t>(begin) * width; i < static_cast<std::size_t>(end) * width; ++i) {
      for (int c = 0; c < 3; ++c) values.push_back(file.image.pixels[i][c]);
      for (const ImageChannel& channel : file.channels) values.push_back(channel.values[i]);
    }
    return values;
  });
}

std::string encode_8_bits(const fs::path& path, const ImageRgb& image, Format format) {
  OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  if (format == Format::jpeg) spec.attribute("Compression", "jpeg:95");
  return encode(path, spec, OIIO::TypeDesc::UINT8, [&](int begin, int end) {
    const std::size_t width = static_cast<std::size_t>(image.width);
    std::vector<unsigned char> values;
    for (std::size_t i = static_cast<std::size_t>(begin) * width; i < static_cast<std::size_t>(end) * width; ++i)
      for (int c = 0; c < 3; ++c)
        values.push_back(static_cast<unsigned char>(std::lround(255.0f * linear_to_srgb(image.pixels[i][c]))));
    return values;
  });
}

/// Where R, G and B (or Y three times) stand among a file's channels.
std::array<int, 3> find_rgb(const fs::path& path, const std::vector<std::string>& names) {
  const auto find = [&](std::string_view name) {
    const auto found = std::find(names.begin(), names.end(), name);
    return found == names.end() ? -1 : static_cast<int>(found - names.begin());
  };
  const std::array<int, 3> rgb{find("R"), find("G"), find("B")};
  if (std::count(rgb.begin(), rgb.end(), -1) == 0) return rgb;
  if (const int grey = find("Y"); grey >= 0) return {grey, grey, grey};
  throw FileError(fmt::format("{}: has no channels R, G, B; it has: {}", path.string(), fmt::join(names, ", ")));
}

void check_finite(const fs::path& path, const ImageRgb& image) {
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (!std::isfinite(image.pixels[i][c]))
        throw FileError(fmt::format("{}: pixel ({}, {}) is not finite, so nothing can be measured against it",
                                    path.string(), i % image.width, i / image.width));
}

void check_size(const fs::path& path, const ImageRgb& image, int width, int height) {
  if (image.width != width || image.height != height)
    throw FileError(fmt::format("{}: is {} x {} pixels, but {} x {} are needed", path.string(), image.width,
                                image.height, width, height));
}

}  // namespace

void ImageFile::add_layer(std::string_view layer, const ImageRgb& values, std::string_view letters) {
  WARPATH_CHECK_EQ(letters.size(), std::size_t{3});
  WARPATH_CHECK_EQ(values.pixels.size(), image.pixels.size());
  for (int c = 0; c < 3; ++c) {
    ImageChannel channel{fmt::format("{}.{}", layer, letters[c]), std::vector<float>(values.pixels.size())};
    for (std::size_t i = 0; i < values.pixels.size(); ++i) channel.values[i] = values.pixels[i][c];
    channels.push_back(std::move(channel));
  }
}

void ImageFile::add_layer(std::string_view layer, std::span<const float> values) {
  WARPATH_CHECK_EQ(values.size(), image.pixels.size());
  channels.push_back({fmt::format("{}.Y", layer), std::vector<float>(values.begin(), values.end())});
}

std::optional<ImageRgb> ImageFile::layer(std::string_view layer, std::string_view letters) const {
  WARPATH_CHECK_EQ(letters.size(), std::size_t{3});
  ImageRgb result(image.width, image.height);
  for (int c = 0; c < 3; ++c) {
    const std::string name = fmt::format("{}.{}", layer, letters[c]);
    const auto channel = std::find_if(channels.begin(), channels.end(), [&](const auto& x) { return x.name == name; });
    if (channel == channels.end()) return std::nullopt;
    for (std::size_t i = 0; i < result.pixels.size(); ++i) result.pixels[i][c] = channel->values[i];
  }
  return result;
}

void check_image_name(const fs::path& path) {
  if (format_of(path) == Format::unknown)
    throw ConfigError(fmt::format("{}: unknown kind of image \"{}\"; known: .exr, .png, .jpg, .jpeg", path.string(),
                                  path.extension().string()));
}

void write_image(const fs::path& path, const ImageFile& file) {
  check_image_name(path);
  const Format format = format_of(path);
  write_atomically(path, format == Format::exr ? encode_exr(path, file) : encode_8_bits(path, file.image, format));
}

void write_image(const fs::path& path, const ImageRgb& image) { write_image(path, ImageFile{image, {}, {}}); }

ImageFile read_image(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) throw FileError(fmt::format("{}: no such image", path.string()));
  const auto input = OIIO::ImageInput::open(path.string());
  if (!input) throw FileError(fmt::format("{}: cannot read: {}", path.string(), OIIO::geterror()));
  const OIIO::ImageSpec& spec = input->spec();
  const std::array<int, 3> rgb = find_rgb(path, spec.channelnames);

  ImageFile file;
  file.image = ImageRgb(spec.width, spec.height);
  const std::size_t channel_count = static_cast<std::size_t>(spec.nchannels);
  std::vector<float> values(file.image.pixels.size() * channel_count);
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, values.data()))
    throw FileError(fmt::format("{}: cannot read: {}", path.string(), input->geterror()));

  const bool is_srgb = !spec.format.is_floating_point();
  for (std::size_t i = 0; i < file.image.pixels.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const float value = values[i * channel_count + rgb[c]];
      file.image.pixels[i][c] = is_srgb ? srgb_to_linear(value) : value;
    }
  for (int c = 0; c < spec.nchannels; ++c) {
    if (std::find(rgb.begin(), rgb.end(), c) != rgb.end()) continue;
    ImageChannel channel{spec.channelnames[c], std::vector<float>(file.image.pixels.size())};
    for (std::size_t i = 0; i < channel.values.size(); ++i) channel.values[i] = values[i * channel_count + c];
    file.channels.push_back(std::move(channel));
  }
  for (const OIIO::ParamValue& attribute : spec.extra_attribs) {
    const std::string name = attribute.name().string();
    if (attribute.type() == OIIO::TypeDesc::STRING) file.attributes[name] = attribute.get_string();
    if (attribute.type() == OIIO::TypeDesc::FLOAT) file.attributes[name] = attribute.get_float();
    if (attribute.type() == OIIO::TypeDesc::INT) file.attributes[name] = attribute.get_int();
  }
  return file;
}

Reference read_reference(const fs::path& path, int width, int height) {
  ImageFile file = read_image(path);
  check_finite(path, file.image);
  if (width > 0 && height > 0) check_size(path, file.image, width, height);

  Reference reference{path, {}, file.layer("variance")};
  reference.image = std::move(file.image);
  fs::path beside = path;
  beside.replace_extension(".variance" + path.extension().string());
  std::error_code error;
  if (fs::exists(beside, error)) {
    reference.variance = read_image(beside).image;
    check_size(beside, *reference.variance, reference.image.width, reference.image.height);
  }
  if (reference.variance) check_finite(fs::exists(beside, error) ? beside : path, *reference.variance);
  return reference;
}

float linear_to_srgb(float x) {
  const float v = clamp01(x);
  return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f;
}

float srgb_to_linear(float x) {
  const float v = clamp01(x);
  return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
}

}  // namespace warpath
