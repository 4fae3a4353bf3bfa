#include "cli/replay.h"

#include "warpath/error.h"

namespace warpath {

Replay::Replay(const std::filesystem::path& results) : m_file(results), m_runs(read_results(results).results) {}

const std::vector<PassRecord>& Replay::passes(const std::string& method, std::uint64_t seed,
                                              const std::string& size) const {
  for (const MethodRun& run : m_runs)
    if (run.method == method && run.seed == seed && run.size == size && !run.passes.empty()) return run.passes;
  throw ConfigError(fmt::format("--replay: {} holds no run of {} under --time with seed {} and size {}",
                                m_file.string(), method, seed, size));
}

}  // namespace warpath
