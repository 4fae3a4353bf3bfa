#include <spdlog/sinks/stdout_sinks.h>

#include <cstdio>
#include <new>

#include "cli/commands.h"
#include "cli/library_pages.h"
#include "cli/terminal.h"
#include "core/interrupt.h"
#include "core/log.h"
#include "warpath/error.h"

namespace {

enum ExitCode { kDone = 0, kFailed = 1, kBadUsage = 2, kBadFile = 3 };

int fail(ExitCode code, const char* what) {
  fmt::print(stderr, "warpath: {}\n", what);
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace warpath;
  give_back_library_pages();
  handle_interrupts();
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("warpath", std::make_shared<spdlog::sinks::stderr_sink_mt>()));
  spdlog::set_pattern("%v");
  try {
    if (const auto command = parse_command_line(argc, argv)) std::visit([](const auto& c) { run(c); }, *command);
    return kDone;
  } catch (const ConfigError& error) {
    return fail(kBadUsage, error.what());
  } catch (const FileError& error) {
    return fail(kBadFile, error.what());
  } catch (const Interrupted&) {
    return fail(kFailed, "interrupted before there was anything to write");
  } catch (const std::bad_alloc&) {
    return fail(kFailed, "out of memory");
  } catch (const std::exception& error) {
    return fail(kFailed, error.what());
  }
}
