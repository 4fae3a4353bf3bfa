#include "core/file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "warpath/error.h"

namespace warpath {
namespace {

namespace fs = std::filesystem;

class WriteAtomicallyTest : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(m_folder); }
  void TearDown() override { fs::remove_all(m_folder); }
  static std::string content(const fs::path& path) {
    std::ifstream stream(path);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  std::ptrdiff_t files() const { return std::distance(fs::directory_iterator(m_folder), fs::directory_iterator()); }

  fs::path m_folder = fs::temp_directory_path() / ("warpath-file-" + std::to_string(::getpid()));
};

TEST_F(WriteAtomicallyTest, WritesReplacesAndMakesFolders) {
  const fs::path path = m_folder / "a" / "b" / "out.txt";
  write_atomically(path, "one");
  EXPECT_EQ(content(path), "one");
  write_atomically(path, "two");
  EXPECT_EQ(content(path), "two");
  EXPECT_EQ(std::distance(fs::directory_iterator(path.parent_path()), fs::directory_iterator()), 1);
}

TEST_F(WriteAtomicallyTest, TheTemporaryFileStandsBesideAndKeepsTheExtension) {
  const fs::path path = m_folder / "image.exr";
  write_atomically(path, [&](const fs::path& temporary) {
    EXPECT_EQ(temporary.parent_path(), m_folder);
    EXPECT_EQ(temporary.extension(), ".exr");
    EXPECT_NE(temporary, path);
    std::ofstream(temporary) << "pixels";
    EXPECT_FALSE(fs::exists(path));
  });
  EXPECT_EQ(content(path), "pixels");
}

TEST_F(WriteAtomicallyTest, AFailureLeavesTheOldFileAndNothingElse) {
  const fs::path path = m_folder / "out.txt";
  write_atomically(path, "old");
  EXPECT_THROW(write_atomically(path,
                                [](const fs::path& temporary) {
                                  std::ofstream(temporary) << "half";
                                  throw std::runtime_error("no more pixels");
                                }),
               std::runtime_error);
  EXPECT_EQ(content(path), "old");
  EXPECT_EQ(files(), 1);
}

TEST_F(WriteAtomicallyTest, ErrorsNameThePathAndTheReason) {
  const fs::path path = m_folder / "out.txt" / "inside.txt";
  write_atomically(m_folder / "out.txt", "a file, not a folder");
  EXPECT_THAT([&] { write_atomically(path, "x"); },
              testing::ThrowsMessage<FileError>(testing::StartsWith(path.string() + ": cannot write: ")));
}

TEST_F(WriteAtomicallyTest, WorksInTheCurrentFolder) {
  const fs::path before = fs::current_path();
  fs::current_path(m_folder);
  write_atomically("plain.txt", "here");
  fs::current_path(before);
  EXPECT_EQ(content(m_folder / "plain.txt"), "here");
}

}  // namespace
}  // namespace warpath
