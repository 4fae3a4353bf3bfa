#pragma once
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

namespace warpath {

/// For tests: a folder that goes away with its files.
class TemporaryFiles {
 public:
  TemporaryFiles() {
    std::string pattern = (std::filesystem::temp_directory_path() / "warpath-scene-XXXXXX").string();
    if (!::mkdtemp(pattern.data())) throw std::runtime_error("cannot make a temporary folder");
    m_folder = pattern;
  }
  ~TemporaryFiles() {
    std::error_code error;
    std::filesystem::remove_all(m_folder, error);
  }
  TemporaryFiles(const TemporaryFiles&) = delete;
  TemporaryFiles& operator=(const TemporaryFiles&) = delete;

  const std::filesystem::path& folder() const { return m_folder; }
  std::filesystem::path write(const std::string& name, std::string_view bytes) const {
    const auto path = m_folder / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream stream(path, std::ios::binary);
    stream << bytes;
    return path;
  }

 private:
  std::filesystem::path m_folder;
};

/// What() of what `act` throws, without the folder's name; empty if it throws nothing.
template <class Error, class Act>
std::string error_of(const TemporaryFiles& files, Act&& act) {
  std::string text;
  try {
    act();
    return text;
  } catch (const Error& error) {
    text = error.what();
  }
  const std::string folder = files.folder().string() + "/";
  for (std::size_t at = text.find(folder); at != std::string::npos; at = text.find(folder))
    text.erase(at, folder.size());
  return text;
}

}  // namespace warpath
