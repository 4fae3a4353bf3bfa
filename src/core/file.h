#pragma once
#include <filesystem>
#include <functional>
#include <span>
#include <string_view>

namespace warpath {

/// Writes a file whole or not at all: `write` gets a temporary path beside `path` (same extension), which is renamed
/// when it returns and removed when it throws. Throws FileError with the path and the system's reason.
void write_atomically(const std::filesystem::path& path,
                      const std::function<void(const std::filesystem::path&)>& write);
/// The same for bytes that are at hand.
void write_atomically(const std::filesystem::path& path, std::string_view bytes);

}  // namespace warpath
