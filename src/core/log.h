#pragma once
#include <spdlog/spdlog.h>

namespace warpath::log {
// Messages for people, on standard error; only the command line decides what is shown.
using spdlog::debug;
using spdlog::info;
using spdlog::warn;
}  // namespace warpath::log
