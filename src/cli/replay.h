#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "path/pass_record.h"
#include "report/results.h"

namespace warpath {

/// The passes of runs under --time, out of the results.json that they left.
class Replay {
 public:
  explicit Replay(const std::filesystem::path& results);  ///< reads it whole; throws FileError
  /// Throws FileError for passes that cannot be rendered, and ConfigError if there is no run of this method (as it is
  /// typed) with this seed and size (WxH).
  const std::vector<PassRecord>& passes(const std::string& method, std::uint64_t seed, const std::string& size) const;

 private:
  std::filesystem::path m_file;
  std::vector<MethodRun> m_runs;
};

}  // namespace warpath
