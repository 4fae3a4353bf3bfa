#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/pass_record.h"

namespace warpath {

/// The passes of a run under --time, out of the results.json that it is in. Throws FileError, and ConfigError if that
/// holds no run of this method (as it is typed) with this seed and size (WxH).
std::vector<PassRecord> recorded_passes(const std::filesystem::path& results, const std::string& method,
                                        std::uint64_t seed, const std::string& size);

}  // namespace warpath
