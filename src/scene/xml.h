#pragma once
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "warpath/error.h"

namespace warpath {

/// The bytes of a scene file, kept while it loads, so that errors can name line and column.
struct SourceFile {
  std::filesystem::path path;
  std::string text;
  int major_version = 3;  ///< of the `version` attribute of its root; below 2 the names are Mitsuba 0.x's camelCase
};

/// A place in a scene file; prints as file:line:column (both from 1, the column in bytes).
struct Location {
  std::shared_ptr<const SourceFile> file;
  std::size_t offset = 0;
};
std::string to_string(const Location& where);

/// Throws SceneError: the place, then the text.
template <class... Args>
[[noreturn]] void fail(const Location& where, fmt::format_string<Args...> text, Args&&... args) {
  throw SceneError(fmt::format("{}: {}", to_string(where), fmt::format(text, std::forward<Args>(args)...)));
}

/// An element with its parameters ($name) substituted and its includes spliced in.
struct XmlElement {
  std::string tag;
  std::vector<std::pair<std::string, std::string>> attributes;
  std::vector<XmlElement> children;
  Location where;

  const std::string* attribute(std::string_view name) const;  ///< null if absent
  const std::string& required_attribute(std::string_view name) const;
  /// SceneError for an attribute that is not in `known`.
  void check_attributes(std::initializer_list<std::string_view> known) const;
};

struct XmlDocument {
  XmlElement root;
  std::vector<std::filesystem::path> folders;  ///< where the scene's files are looked for, in this order
};

/// Reads a scene file with its includes. `defines` replace the values of <default> and of $name.
/// Throws SceneError, or ConfigError for a define that no file of the scene uses.
XmlDocument read_scene_xml(const std::filesystem::path& file,
                           const std::vector<std::pair<std::string, std::string>>& defines);

/// The file as it is found from the folders; the name itself if none has it.
std::filesystem::path find_file(const std::vector<std::filesystem::path>& folders, const std::filesystem::path& name);

}  // namespace warpath
