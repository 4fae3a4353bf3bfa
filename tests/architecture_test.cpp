// Data flows one way: each folder includes only what docs/architecture.md lists for it. In particular `tracer` and
// `warp` never see each other, which is what makes the renderer a black box.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>

namespace fs = std::filesystem;

namespace {

const std::map<std::string, std::set<std::string>> kAllowed{
    {"core", {}},
    {"path", {"core"}},
    {"scene", {"core"}},
    {"tracer", {"scene", "path", "core"}},
    {"integrand", {"tracer", "scene", "path", "core"}},
    {"nn", {"core"}},
    {"warp", {"nn", "path", "core"}},
    {"train", {"warp", "nn", "path", "core"}},
    {"family", {"train", "warp", "nn", "path", "core"}},
    {"integrate", {"family", "train", "warp", "integrand", "path", "core"}},
    {"estimate", {"warp", "integrand", "tracer", "scene", "path", "core"}},
    {"render", {"estimate", "family", "train", "warp", "integrand", "tracer", "scene", "path", "core"}},
    {"report", {"path", "core"}},
    {"cli",
     {"core", "path", "scene", "tracer", "integrand", "nn", "warp", "train", "family", "integrate", "estimate",
      "render", "report"}},
};

bool is_code(const fs::path& path) { return path.extension() == ".h" || path.extension() == ".cpp"; }

TEST(Architecture, FoldersIncludeOnlyWhatTheyMay) {
  const fs::path source = fs::path(WARPATH_SOURCE_DIR) / "src";
  const std::regex include(R"(^\s*#include\s+"([a-z_]+)/)");
  int seen = 0;
  for (const auto& entry : fs::recursive_directory_iterator(source)) {
    if (!entry.is_regular_file() || !is_code(entry.path())) continue;
    const std::string folder = fs::relative(entry.path(), source).begin()->string();
    ASSERT_TRUE(kAllowed.contains(folder)) << "src/" << folder << " has no place in the data flow";
    std::ifstream stream(entry.path());
    int number = 0;
    for (std::string line; std::getline(stream, line);) {
      ++number;
      std::smatch match;
      if (!std::regex_search(line, match, include)) continue;
      ++seen;
      const std::string used = match[1];
      EXPECT_TRUE(used == folder || used == "warpath" || kAllowed.at(folder).contains(used))
          << entry.path() << ":" << number << ": " << folder << " must not include " << used;
    }
  }
  EXPECT_GT(seen, 50) << "the scan found hardly any include: its pattern no longer fits the code";
}

TEST(Architecture, EveryFolderIsKnown) {
  for (const auto& entry : fs::directory_iterator(fs::path(WARPATH_SOURCE_DIR) / "src"))
    if (entry.is_directory()) {
      EXPECT_TRUE(kAllowed.contains(entry.path().filename().string())) << entry.path();
    }
}

}  // namespace
