#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "path/layout.h"
#include "warp/proposal.h"

namespace warpath {

class VertexProposal;

/// A trained warp as a file: a proposal or a warp of the numbers of vertices, and what it was trained on.
struct WarpFile {
  std::shared_ptr<const Proposal> proposal;               ///< null for a warp of vertices
  std::shared_ptr<const VertexProposal> vertex_proposal;  ///< null for a proposal
  /// The dimensions that a proposal warps, as many as it has; those that a warp of vertices draws, empty for all.
  Layout layout;
  std::string scene;                            ///< name of the scene, for people
  std::map<std::string, std::string> settings;  ///< of the training, by name
};

/// Writes safetensors, atomically. Throws FileError.
void save_warp(const std::filesystem::path& path, const WarpFile& file);
/// Throws FileError that names the file and what is wrong with it.
WarpFile load_warp(const std::filesystem::path& path);
/// `kdtree`, `mixture`, `field`, ...
std::string family_of(const WarpFile& file);

}  // namespace warpath
