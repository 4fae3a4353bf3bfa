#include "cli/replay.h"

#include "family/family.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr int kMostSpp = 1 << 24;

/// A file may have been written by hand: passes that cannot be rendered are refused. Throws FileError.
void check(const std::filesystem::path& file, const PassRecord& pass) {
  const auto refuse = [&](const std::string& what) {
    throw FileError(fmt::format("{}: passes: {}", file.string(), what));
  };
  if (pass.spp < 1 || pass.spp > kMostSpp) refuse(fmt::format("{} samples per pixel, not 1 to {}", pass.spp, kMostSpp));
  if (pass.batches < 1) refuse("a pass of no batches");
  if (pass.drawn_by != kNoWarp && !find_family(pass.drawn_by))
    refuse(fmt::format("drawn_by \"{}\" is neither none nor a family", pass.drawn_by));
}

}  // namespace

Replay::Replay(const std::filesystem::path& results) : m_file(results), m_runs(read_results(results).results) {}

const std::vector<PassRecord>& Replay::passes(const std::string& method, std::uint64_t seed,
                                              const std::string& size) const {
  for (const MethodRun& run : m_runs)
    if (run.method == method && run.seed == seed && run.size == size && !run.passes.empty()) {
      for (const PassRecord& pass : run.passes) check(m_file, pass);
      return run.passes;
    }
  throw ConfigError(fmt::format("--replay: {} holds no run of {} under --time with seed {} and size {}",
                                m_file.string(), method, seed, size));
}

}  // namespace warpath
