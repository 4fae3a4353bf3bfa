#pragma once
#include <filesystem>

#include "cli/comparison.h"

namespace warpath {

/// Writes everything that a comparison found as one self-contained page.
void write_report(const std::filesystem::path& path, const ComparisonRunner& runner);

}  // namespace warpath
