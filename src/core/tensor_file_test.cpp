#include "core/tensor_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/rng.h"
#include "warpath/error.h"

namespace warpath {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class TensorFileTest : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(m_folder); }
  void TearDown() override { fs::remove_all(m_folder); }

  /// A file of these bytes: header length, header, data.
  fs::path write(const std::string& header, const std::string& data, std::uint64_t header_size) {
    std::string bytes(8, '\0');
    for (int i = 0; i < 8; ++i) bytes[static_cast<std::size_t>(i)] = static_cast<char>(header_size >> (8 * i));
    return write(bytes + header + data);
  }
  fs::path write(const std::string& header, const std::string& data) { return write(header, data, header.size()); }
  fs::path write(const std::string& bytes) {
    const fs::path path = m_folder / "hostile.warp";
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }
  /// The text of the FileError that loading gives.
  std::string error(const fs::path& path) {
    try {
      TensorFile::load(path);
    } catch (const FileError& e) {
      return e.what();
    }
    return "no error";
  }

  fs::path m_folder = fs::temp_directory_path() / fmt::format("warpath-tensor-file-{}", ::getpid());
};

TensorFile example() {
  TensorFile file;
  file.put<float>("weights", {2, 3}, std::vector<float>{1, 2, 3, 4, 5, -0.0f});
  file.put<double>("edges", {2}, std::vector<double>{0.1, 1e-300});
  file.put<std::int32_t>("ints", {1, 1}, std::vector<std::int32_t>{-7});
  file.put<std::int64_t>("longs", {}, std::vector<std::int64_t>{1LL << 40});
  file.put<std::uint8_t>("bytes", {3}, std::vector<std::uint8_t>{1, 255, 0});
  file.put<float>("empty", {0, 4}, std::vector<float>{});
  file.metadata()["family"] = "kdtree";
  file.metadata()["quote"] = "a \"b\" \\ ü\n";
  return file;
}

TEST_F(TensorFileTest, RoundTrip) {
  const fs::path path = m_folder / "a.warp";
  example().save(path);
  const TensorFile file = TensorFile::load(path);
  EXPECT_EQ(file.entries().size(), 6u);
  EXPECT_EQ(file.get<float>("weights").values, (std::vector<float>{1, 2, 3, 4, 5, -0.0f}));
  EXPECT_EQ(file.get<float>("weights").shape, (std::vector<std::int64_t>{2, 3}));
  EXPECT_EQ(file.get<double>("edges").values, (std::vector<double>{0.1, 1e-300}));
  EXPECT_EQ(file.get<std::int32_t>("ints").values, (std::vector<std::int32_t>{-7}));
  EXPECT_EQ(file.get<std::int64_t>("longs").values, (std::vector<std::int64_t>{1LL << 40}));
  EXPECT_TRUE(file.get<std::int64_t>("longs").shape.empty());
  EXPECT_EQ(file.get<std::uint8_t>("bytes").values, (std::vector<std::uint8_t>{1, 255, 0}));
  EXPECT_TRUE(file.get<float>("empty").values.empty());
  EXPECT_EQ(file.metadata(), example().metadata());
}

TEST_F(TensorFileTest, TensorsAreAlignedInTheFile) {
  const fs::path path = m_folder / "a.warp";
  example().save(path);
  std::ifstream stream(path, std::ios::binary);
  std::uint64_t header_size = 0;
  stream.read(reinterpret_cast<char*>(&header_size), 8);
  EXPECT_EQ(header_size % 8, 0u);
  std::string header(header_size, '\0');
  stream.read(header.data(), static_cast<std::streamsize>(header_size));
  EXPECT_THAT(header, HasSubstr(R"("edges":{"data_offsets":[0,16],"dtype":"F64","shape":[2]})"));
}

TEST_F(TensorFileTest, WhatIsMissingOrOfAnotherTypeIsNamed) {
  const fs::path path = m_folder / "a.warp";
  example().save(path);
  const TensorFile file = TensorFile::load(path);
  const auto text = [](const auto& f) {
    try {
      f();
    } catch (const FileError& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_EQ(text([&] { file.get<float>("wieghts"); }), path.string() + ": has no tensor \"wieghts\"");
  EXPECT_EQ(text([&] { file.get<double>("weights"); }), path.string() + ": tensor \"weights\" is of type F32, not F64");
  EXPECT_EQ(text([&] { file.meta("scene"); }), path.string() + ": has no metadata \"scene\"");
}

TEST_F(TensorFileTest, HostileFilesGiveOneClearError) {
  const std::string data(16, 'x');
  const auto tensor = [](const std::string& dtype, const std::string& shape, const std::string& offsets) {
    return fmt::format(R"({{"t":{{"dtype":{},"shape":{},"data_offsets":{}}}}})", dtype, shape, offsets);
  };
  EXPECT_THAT(error(m_folder / "none.warp"), HasSubstr("no such file"));
  EXPECT_THAT(error(m_folder), HasSubstr("not a regular file"));
  EXPECT_THAT(error(write("")), HasSubstr("only 0 bytes"));
  EXPECT_THAT(error(write("{}", "", ~0ull)), HasSubstr("header would have 18446744073709551615 bytes"));
  EXPECT_THAT(error(write("{}", "", 3)), HasSubstr("header would have 3 bytes"));
  EXPECT_THAT(error(write("{\"t\":", "")), HasSubstr("not JSON"));
  EXPECT_THAT(error(write("[1]", "")), HasSubstr("not a JSON object"));
  EXPECT_THAT(error(write(std::string(1'000'000, '['), "")), HasSubstr("nested too deeply"));
  EXPECT_THAT(error(write(R"({"a":{},"a":{}})", "")), HasSubstr("\"a\" twice"));
  EXPECT_THAT(error(write(R"({"a":1})", "")), HasSubstr("lacks dtype"));
  EXPECT_THAT(error(write(R"({"__metadata__":{"k":1}})", "")), HasSubstr("metadata \"k\" is not a string"));
  EXPECT_THAT(error(write(tensor("\"BF16\"", "[8]", "[0,16]"), data)), HasSubstr("is of type BF16; known: F32"));
  EXPECT_THAT(error(write(tensor("4", "[4]", "[0,16]"), data)), HasSubstr("dtype that is not a string"));
  EXPECT_THAT(error(write(tensor("\"F32\"", "[-4]", "[0,16]"), data)), HasSubstr("not a whole number"));
  EXPECT_THAT(error(write(tensor("\"F32\"", "[4.0]", "[0,16]"), data)), HasSubstr("not a whole number"));
  EXPECT_THAT(error(write(tensor("\"F32\"", "{}", "[0,16]"), data)), HasSubstr("shape that is not an array"));
  EXPECT_THAT(error(write(tensor("\"F32\"", "[4]", "[0]"), data)), HasSubstr("not two whole numbers"));
  EXPECT_THAT(error(write(tensor("\"F32\"", "[4]", "[-1,15]"), data)), HasSubstr("not two whole numbers"));
  EXPECT_THAT(error(write(tensor("\"F32\"", "[8]", "[0,32]"), data)), HasSubstr("outside of the 16 bytes"));
  EXPECT_THAT(error(write(tensor("\"F32\"", "[4]", "[16,0]"), data)), HasSubstr("outside of the 16 bytes"));
  EXPECT_THAT(error(write(tensor("\"F32\"", "[3]", "[0,16]"), data)), HasSubstr("has 16 bytes, not those of F32 x 3"));
  EXPECT_THAT(error(write(tensor("\"F32\"", "[4294967296,4294967296,4]", "[0,16]"), data)), HasSubstr("not those of"));
  EXPECT_THAT(error(write(tensor("\"F32\"", "[4611686018427387905]", "[0,4]"), "1234")), HasSubstr("not those of"));
  EXPECT_THAT(error(write(tensor("\"F32\"", "[3]", "[4,16]"), data)),
              HasSubstr("begins at byte 4 of the data, not at 0"));
  EXPECT_THAT(error(write(tensor("\"F32\"", "[3]", "[0,12]"), data)), HasSubstr("4 bytes follow"));
  EXPECT_THAT(error(write(R"({"a":{"dtype":"U8","shape":[8],"data_offsets":[0,8]},)"
                          R"("b":{"dtype":"U8","shape":[12],"data_offsets":[4,16]}})",
                          data)),
              HasSubstr("\"b\" begins at byte 4 of the data, not at 8"));
}

TEST_F(TensorFileTest, BrokenBytesNeverCrash) {
  constexpr std::uint64_t kSeed = 7;
  const fs::path path = m_folder / "a.warp";
  example().save(path);
  std::ifstream stream(path, std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(stream)), {});
  int errors = 0;
  for (std::uint64_t i = 0; i < 500; ++i) {
    std::string bytes = whole;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint64_t bits = sample_bits(sample_key(kSeed, i), k);
      bytes[bits % bytes.size()] = static_cast<char>(bits >> 56);
    }
    if (i % 4 == 0) bytes.resize(sample_bits(sample_key(kSeed, i), 9) % bytes.size());
    const std::string text = error(write(bytes));
    if (text != "no error") {
      ++errors;
      EXPECT_TRUE(text.starts_with((m_folder / "hostile.warp").string())) << text;
    }
  }
  EXPECT_GT(errors, 250);
}

TEST_F(TensorFileTest, AFailedSaveKeepsTheOldFile) {
  const fs::path path = m_folder / "a.warp";
  example().save(path);
  EXPECT_THROW(example().save(path / "b.warp"), FileError);
  EXPECT_EQ(TensorFile::load(path).entries().size(), 6u);
  EXPECT_EQ(std::distance(fs::directory_iterator(m_folder), fs::directory_iterator()), 1);
}

}  // namespace
}  // namespace warpath
