#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "warpath/layout.h"
#include "warpath/warp.h"

namespace warpath {

/// A trained warp as a file: a proposal and what it was trained on.
struct WarpFile {
  std::shared_ptr<const Proposal> proposal;
  Layout layout;                                ///< the dimensions that it warps; as many as the proposal has
  std::string scene;                            ///< name of the scene, for people
  std::map<std::string, std::string> settings;  ///< of the training, by name
};

/// Writes safetensors, atomically. Throws FileError.
void save_warp(const std::filesystem::path& path, const WarpFile& file);
/// Throws FileError that names the file and what is wrong with it.
WarpFile load_warp(const std::filesystem::path& path);

}  // namespace warpath
