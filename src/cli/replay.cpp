#include "cli/replay.h"

#include "report/results.h"
#include "warpath/error.h"

namespace warpath {

std::vector<PassRecord> recorded_passes(const std::filesystem::path& results, const std::string& method,
                                        std::uint64_t seed, const std::string& size) {
  for (MethodRun& run : read_results(results).results)
    if (run.method == method && run.seed == seed && run.size == size && !run.passes.empty())
      return std::move(run.passes);
  throw ConfigError(fmt::format("--replay: {} holds no run of {} under --time with seed {} and size {}",
                                results.string(), method, seed, size));
}

}  // namespace warpath
