#pragma once

#include <string>

namespace CLI {
class App;
}

namespace warpath {

// Each adds one command to the app; it runs when that command was parsed. They throw what warpath/error.h names.
void add_render_command(CLI::App& app);
void add_train_command(CLI::App& app);
void add_compare_command(CLI::App& app, const std::string& command_line);
void add_inspect_command(CLI::App& app);

}  // namespace warpath
