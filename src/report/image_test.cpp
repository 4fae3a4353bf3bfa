#include "report/image.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstring>
#include <fstream>
#include <functional>

#include "warpath/error.h"

namespace warpath {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class ImageFileTest : public testing::Test {
 protected:
  ImageFileTest()
      : m_folder(fs::path(testing::TempDir()) / (std::string("warpath_image_") + std::to_string(getpid()))) {
    fs::create_directories(m_folder);
  }
  ~ImageFileTest() override { fs::remove_all(m_folder); }
  fs::path path(const std::string& name) const { return m_folder / name; }
  std::size_t file_count() const { return std::distance(fs::directory_iterator(m_folder), fs::directory_iterator()); }

  static ImageRgb gradient(int width, int height) {
    ImageRgb image(width, height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) image.at(x, y) = Color(x + 0.1f, y * 1e-3f, -1.0f / (1 + x + y));
    return image;
  }

  static void expect_throw_with(const std::function<void()>& f, const std::vector<std::string>& parts) {
    try {
      f();
      FAIL() << "no error";
    } catch (const FileError& error) {
      for (const std::string& part : parts) EXPECT_THAT(error.what(), HasSubstr(part));
    }
  }

 private:
  fs::path m_folder;
};

TEST_F(ImageFileTest, exr_keeps_every_bit_channel_and_attribute) {
  ImageFile file{gradient(7, 5), {}, {}};
  const ImageRgb variance(7, 5, Color(0.1f, 0.2f, 0.3f));
  const ImageRgb normal(7, 5, Color(0.0f, 0.6f, 0.8f));
  std::vector<float> samples(35);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = 100.0f + i;
  file.add_layer("variance", variance);
  file.add_layer("normal", normal, "XYZ");
  file.add_layer("samples", samples);
  file.attributes = {
      {"warpath:method", std::string("realnvp:film+bounce1")}, {"warpath:spp", 128}, {"warpath:seconds", 1.5f}};
  write_image(path("image.exr"), file);
  EXPECT_EQ(file_count(), 1u);

  const ImageFile read = read_image(path("image.exr"));
  EXPECT_EQ(read.image.width, 7);
  EXPECT_EQ(read.image.height, 5);
  EXPECT_EQ(read.image.pixels, file.image.pixels);
  ASSERT_TRUE(read.layer("variance").has_value());
  EXPECT_EQ(read.layer("variance")->pixels, variance.pixels);
  EXPECT_EQ(read.layer("normal", "XYZ")->pixels, normal.pixels);
  EXPECT_FALSE(read.layer("albedo").has_value());
  const auto counts =
      std::find_if(read.channels.begin(), read.channels.end(), [](const auto& c) { return c.name == "samples.Y"; });
  ASSERT_NE(counts, read.channels.end());
  EXPECT_EQ(counts->values, samples);
  for (const auto& [name, value] : file.attributes) {
    ASSERT_TRUE(read.attributes.contains(name)) << name;
    EXPECT_EQ(read.attributes.at(name), value) << name;
  }
}

TEST_F(ImageFileTest, png_and_jpeg_hold_the_srgb_curve) {
  ImageRgb image(16, 16, Color(0.25f, 0.5f, 2.0f));
  image.at(0, 0) = Color(std::numeric_limits<float>::quiet_NaN(), -1.0f, 1.0f);
  write_image(path("image.png"), image);
  const auto input = OIIO::ImageInput::open(path("image.png").string());
  ASSERT_TRUE(input);
  EXPECT_EQ(input->spec().nchannels, 3);
  EXPECT_EQ(input->spec().format, OIIO::TypeDesc::UINT8);
  std::vector<unsigned char> bytes(16 * 16 * 3);
  ASSERT_TRUE(input->read_image(0, 0, 0, 3, OIIO::TypeDesc::UINT8, bytes.data()));
  // 0.25 and 0.5 under IEC 61966-2-1: 0.5370987 and 0.7353569 of 255.
  EXPECT_EQ(std::vector<int>(bytes.begin(), bytes.begin() + 6), (std::vector<int>{0, 0, 255, 137, 188, 255}));

  for (const char* name : {"image.jpg", "image.JPEG"}) {
    write_image(path(name), ImageRgb(16, 16, Color(0.25f, 0.5f, 0.75f)));
    const Color pixel = read_image(path(name)).image.at(8, 8);
    EXPECT_NEAR(pixel.x, 0.25f, 0.01f) << name;
    EXPECT_NEAR(pixel.y, 0.5f, 0.015f) << name;
    EXPECT_NEAR(pixel.z, 0.75f, 0.02f) << name;
  }
}

TEST_F(ImageFileTest, srgb_curve_inverts) {
  for (int i = 0; i <= 255; ++i) EXPECT_NEAR(linear_to_srgb(srgb_to_linear(i / 255.0f)) * 255, i, 1e-3);
  EXPECT_EQ(linear_to_srgb(7.0f), linear_to_srgb(1.0f));
  EXPECT_EQ(linear_to_srgb(-7.0f), 0.0f);
}

TEST_F(ImageFileTest, an_unknown_ending_is_bad_usage) {
  EXPECT_THROW(check_image_name("out.gif2"), ConfigError);
  EXPECT_THROW(write_image(path("out"), gradient(2, 2)), ConfigError);
  EXPECT_NO_THROW(check_image_name("a.b/OUT.EXR"));
  EXPECT_EQ(file_count(), 0u);
}

TEST_F(ImageFileTest, what_cannot_be_read_is_an_error_with_path_and_reason) {
  expect_throw_with([&] { read_image(path("absent.exr")); }, {"absent.exr", "no such image"});
  std::ofstream(path("text.exr")) << "not an image";
  expect_throw_with([&] { read_image(path("text.exr")); }, {"text.exr", "cannot read"});

  write_image(path("whole.exr"), gradient(64, 64));
  fs::copy(path("whole.exr"), path("cut.exr"));
  fs::resize_file(path("cut.exr"), fs::file_size(path("whole.exr")) / 2);
  expect_throw_with([&] { read_image(path("cut.exr")); }, {"cut.exr", "cannot read"});

  const auto output = OIIO::ImageOutput::create(path("depth.exr").string());
  OIIO::ImageSpec spec(2, 2, 1, OIIO::TypeDesc::FLOAT);
  spec.channelnames = {"Z"};
  const float zeros[4] = {};
  ASSERT_TRUE(output->open(path("depth.exr").string(), spec) && output->write_image(OIIO::TypeDesc::FLOAT, zeros) &&
              output->close());
  expect_throw_with([&] { read_image(path("depth.exr")); }, {"depth.exr", "no channels R, G, B", "Z"});
}

// A limit on file size stands in for a full disk: both cut a write short.
TEST_F(ImageFileTest, a_write_cut_short_is_reported_and_leaves_nothing_behind) {
  write_image(path("old.exr"), ImageRgb(2, 2, Color(3.0f)));
  rlimit saved;
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &saved), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  for (const char* name : {"new.exr", "new.png", "new.jpg", "old.exr"}) {
    ImageRgb noise(128, 128);
    for (std::size_t i = 0; i < noise.pixels.size(); ++i) noise.pixels[i] = Color(i * 2654435761u % 1009 / 1009.0f);
    const rlimit small{1000, saved.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
    std::string text;
    try {
      write_image(path(name), noise);
    } catch (const FileError& error) {
      text = error.what();
    }
    setrlimit(RLIMIT_FSIZE, &saved);
    EXPECT_THAT(text, HasSubstr(name));
    EXPECT_THAT(text, HasSubstr(std::strerror(EFBIG)));
  }
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(file_count(), 1u);
  EXPECT_EQ(read_image(path("old.exr")).image.at(1, 1), Color(3.0f));
}

TEST_F(ImageFileTest, a_folder_that_cannot_be_made_is_reported) {
  std::ofstream(path("file")) << "x";
  expect_throw_with([&] { write_image(path("file") / "image.exr", gradient(2, 2)); }, {"image.exr", "cannot write"});
}

TEST_F(ImageFileTest, a_reference_brings_its_variance) {
  write_image(path("plain.exr"), gradient(4, 3));
  EXPECT_FALSE(read_reference(path("plain.exr")).variance.has_value());

  write_image(path("ref.exr"), gradient(4, 3));
  write_image(path("ref.variance.exr"), ImageRgb(4, 3, Color(0.5f)));
  const Reference beside = read_reference(path("ref.exr"), 4, 3);
  EXPECT_EQ(beside.image.pixels, gradient(4, 3).pixels);
  ASSERT_TRUE(beside.variance.has_value());
  EXPECT_EQ(beside.variance->at(3, 2), Color(0.5f));

  ImageFile own{gradient(4, 3), {}, {}};
  own.add_layer("variance", ImageRgb(4, 3, Color(0.25f)));
  write_image(path("own.exr"), own);
  ASSERT_TRUE(read_reference(path("own.exr")).variance.has_value());
  EXPECT_EQ(read_reference(path("own.exr")).variance->at(0, 0), Color(0.25f));
}

TEST_F(ImageFileTest, a_reference_that_does_not_fit_is_an_error) {
  write_image(path("ref.exr"), gradient(4, 3));
  expect_throw_with([&] { read_reference(path("ref.exr"), 8, 6); }, {"ref.exr", "4 x 3", "8 x 6"});
  write_image(path("ref.variance.exr"), gradient(4, 4));
  expect_throw_with([&] { read_reference(path("ref.exr")); }, {"ref.variance.exr", "4 x 4", "4 x 3"});

  ImageRgb broken(4, 3);
  broken.at(2, 1).y = std::numeric_limits<float>::infinity();
  write_image(path("broken.exr"), broken);
  expect_throw_with([&] { read_reference(path("broken.exr")); }, {"broken.exr", "pixel (2, 1)"});
}

}  // namespace
}  // namespace warpath
