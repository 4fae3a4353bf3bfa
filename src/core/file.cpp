#include "core/file.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "warpath/error.h"

namespace warpath {
namespace fs = std::filesystem;

void write_atomically(const fs::path& path, const std::function<void(const fs::path&)>& write) {
  // The extension stays last: image writers choose their format by it.
  const fs::path temporary =
      path.parent_path() / fmt::format(".{}.{}.tmp{}", path.stem().string(), ::getpid(), path.extension().string());
  try {
    if (path.has_parent_path()) fs::create_directories(path.parent_path());
    write(temporary);
    fs::rename(temporary, path);
  } catch (const fs::filesystem_error& error) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw FileError(fmt::format("{}: cannot write: {}", path.string(), error.code().message()));
  } catch (...) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw;
  }
}

void write_atomically(const fs::path& path, std::string_view bytes) {
  write_atomically(path, [&](const fs::path& temporary) {
    std::ofstream stream(temporary, std::ios::binary);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    stream.close();
    if (!stream) throw FileError(fmt::format("{}: cannot write: {}", path.string(), std::strerror(errno)));
  });
}

}  // namespace warpath
