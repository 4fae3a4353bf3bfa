#include <CLI/CLI.hpp>
#include <cstdio>
#include <new>

#include <spdlog/sinks/stdout_sinks.h>
#include "cli/commands.h"
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

/// As it was typed: words with anything but plain characters in quotes.
std::string command_line(int argc, char** argv) {
  constexpr auto kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=:,./";
  std::string line = "warpath";
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const bool plain = !word.empty() && word.find_first_not_of(kPlain) == std::string::npos;
    line += plain ? " " + word : " '" + word + "'";
  }
  return line;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace warpath;
  CLI::App app{"warpath learns where a Monte Carlo renderer should put its samples"};
  app.set_version_flag("--version", "warpath " WARPATH_VERSION);
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  add_render_command(app);
  add_train_command(app);
  add_compare_command(app, command_line(argc, argv));
  add_inspect_command(app);
  handle_interrupts();
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("warpath", std::make_shared<spdlog::sinks::stderr_sink_mt>()));
  spdlog::set_pattern("%v");
  try {
    app.parse(argc, argv);
    return kDone;
  } catch (const CLI::ParseError& error) {
    // Help and version are not failures; everything else is bad usage, in one line.
    if (error.get_exit_code() == 0) return app.exit(error);
    return fail(kBadUsage, error.what());
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
