#pragma once
#include <functional>
#include <memory>
#include <string>

#include "core/tensor_file.h"
#include "warp/proposal.h"

namespace warpath {

inline constexpr int kMaxDims = 256;  ///< of every proposal; of a kd-tree KdTree::kMaxDims

/// Loads a proposal of whatever family that Proposal::save put under a prefix. Throws FileError.
using ProposalLoader =
    std::function<std::shared_ptr<const Proposal>(const TensorFile& file, const std::string& prefix)>;

/// What every family stores: `<prefix>family` and `<prefix>dims` in the metadata.
void save_header(TensorFile& file, const std::string& prefix, const Proposal& proposal);
/// The stored number of dimensions; throws FileError if it is not in 1 ... kMaxDims.
int load_dims(const TensorFile& file, const std::string& prefix);
/// Throws FileError: the file, the proposal under `prefix`, and what is wrong with it.
[[noreturn]] void fail_load(const TensorFile& file, const std::string& prefix, std::string_view what);

}  // namespace warpath
