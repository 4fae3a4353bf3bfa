#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "family/family.h"
#include "path/layout.h"

namespace warpath {

/// A way to draw the numbers of paths, as it is named on the command line: `none`, FAMILY[:DIMS], `auto`, or a warp
/// file.
struct Method {
  std::string name;                ///< as typed
  const Family* family = nullptr;  ///< null for `none`
  Layout layout{};                 ///< empty for `none`, and where the numbers of every vertex are warped
  std::filesystem::path file{};    ///< of a trained warp; empty if it is trained now
  bool automatic = false;          ///< whether the warp is given up where it does not pay

  /// `none`, `auto`, or the family's.
  std::string family_name() const;
  /// Whose options of training it takes: none for a warp file.
  std::string trained_family() const;
  bool warps_film() const { return layout.contains({GroupKind::film}); }
};
/// Throws ConfigError that lists the families, or FileError if a warp file cannot be read.
Method parse_method(const std::string& text);

/// What can stand before DIMS: `none`, the families, `auto`.
std::vector<std::string> method_names();

}  // namespace warpath
