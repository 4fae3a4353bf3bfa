#include <CLI/CLI.hpp>

#include "cli/commands.h"
#include "warpath/error.h"

// The only file that includes CLI11, which is slow to compile.
namespace warpath {
namespace {

constexpr int kMostThreads = 1024;

/// An option that hands its text on; what it is like unless given stands in brackets.
CLI::Option* add_row(CLI::App& app, const Option& option, std::function<void(const std::string&)> set,
                     const std::string& users = {}) {
  std::string help = option.help;
  if (const std::string value = option.defaults(); !value.empty()) help += fmt::format(" [{}]", value);
  auto* added = app.add_option_function<std::string>("--" + option.name, std::move(set), help + users);
  return added->type_name(option.domain())->group(option.group);
}

/// Rows of a table whose values go where the table is bound to.
void add_rows(CLI::App& app, const std::vector<Option>& table) {
  for (const Option& option : table) {
    auto* added = add_row(app, option, [option](const std::string& text) { option.set(text, "--" + option.name); });
    for (const std::string& other : option.excludes) added->excludes("--" + other);
  }
}

/// Rows of training, which are kept until it is known which families read them.
void add_rows(CLI::App& app, TrainingOptions& options, bool trained) {
  TrainSettings settings;
  for (const Option& option : training_option_table(settings))
    add_row(
        app, option, [&options, name = option.name](const std::string& text) { options.set(name, text); },
        fmt::format(" ({})", fmt::join(users_of(option, trained), ", ")));
  // Called so by earlier users: the message says the new name.
  app.add_option_function<std::string>("--uniform",
                                       [&options](const std::string& text) { options.set("uniform", text); })
      ->group("");
}

void add_rows(CLI::App& app, ProcessOptions& options) {
  const Option threads{
      "threads", "Process", "Threads to use (default: all)", {{"", whole(options.threads, 1, kMostThreads)}}};
  add_rows(app, std::vector{threads});
  auto* loud = app.add_flag("--verbose", options.verbose, "Tell more")->group("Process");
  app.add_flag("--quiet", options.quiet, "Show warnings and errors only")->group("Process")->excludes(loud);
}

void add_scene(CLI::App& app, SceneRequest& scene) {
  app.add_option("scene", scene.file, "Mitsuba 3 scene file")->required();
  add_rows(app, scene_option_table(scene));
  app.add_option_function<std::vector<std::string>>(
         "-D",
         [&scene](const std::vector<std::string>& defines) {
           for (const std::string& define : defines) {
             const std::size_t equals = define.find('=');
             if (equals == std::string::npos || equals == 0)
               throw ConfigError(fmt::format("-D: \"{}\" is not of the form name=value", define));
             scene.parameters.emplace_back(define.substr(0, equals), define.substr(equals + 1));
           }
         },
         "Value of a parameter of the scene")
      ->type_name("name=value")
      ->group("Scene")
      ->allow_extra_args(false);
}

void add_replay(CLI::App& app, std::filesystem::path& replay) {
  const Option row{
      "replay",
      "Render",
      "results.json of runs under --time: renders the passes of the run with the same method, seed and size",
      {{"", existing_file(replay)}},
      {"spp", "time"}};
  add_rows(app, std::vector{row});
}

std::string warp_help(const std::vector<std::string>& names) {
  return fmt::format("FAMILY[:DIMS] or a trained warp's file; families: {}", fmt::join(names, ", "));
}

CLI::App* add_command(CLI::App& app, RenderCommand& command) {
  CLI::App* sub = app.add_subcommand("render", "Render a scene");
  add_scene(*sub, command.scene);
  sub->add_option("-o,--output", command.output, "Image to write: .exr (with variance), .png, .jpg")
      ->capture_default_str();
  sub->add_option("--warp", command.warp, warp_help(method_names()))->capture_default_str();
  sub->add_option("--aov", command.aov, "Further layers: albedo, normal, depth")->type_name("LIST");
  add_rows(*sub, render_option_table(command.render));
  add_replay(*sub, command.replay);
  add_rows(*sub, command.training, false);
  add_rows(*sub, command.process);
  return sub;
}

CLI::App* add_command(CLI::App& app, TrainCommand& command) {
  CLI::App* sub = app.add_subcommand("train", "Train a warp and save it");
  add_scene(*sub, command.scene);
  const auto trainable = family_names([](const Family& family) { return family.learns(); });
  sub->add_option("--warp", command.warp, warp_help(trainable))->required();
  sub->add_option("-o,--output", command.output, "File to write (safetensors)")->required();
  RenderSettings settings;
  Option seed = find_option(render_option_table(settings), "seed");
  seed.uses = {{"", whole(command.seed, 0, std::numeric_limits<std::uint64_t>::max())}};
  add_rows(*sub, std::vector{seed});
  add_rows(*sub, command.training, true);
  add_rows(*sub, command.process);
  return sub;
}

CLI::App* add_command(CLI::App& app, CompareCommand& command) {
  CLI::App* sub = app.add_subcommand("compare", "Render a scene by several methods, and report what each gains");
  add_scene(*sub, command.scene);
  sub->add_option("--methods", command.methods, "Each none, FAMILY[:DIMS] or a trained warp's file")
      ->delimiter(',')
      ->capture_default_str();
  sub->add_option("--report", command.directory, "Folder for images, results.json and index.html")->required();
  add_rows(
      *sub,
      {{"runs", "Comparison", "Repetitions with seeds that follow each other", {{"", whole(command.runs, 1, 10000)}}},
       {"reference",
        "Comparison",
        "Image to measure against (ref.variance.exr beside it is its noise)",
        {{"", existing_file(command.reference)}}},
       {"reference-spp",
        "Comparison",
        "Samples of the reference that is rendered where none is given (default: 8 x spp)",
        {{"", whole(command.reference_spp, 1, 1 << 24)}},
        {"reference"}}});
  sub->add_flag("--resume", command.resume,
                "Keep the runs that an interrupted call of the same command left in the report's folder")
      ->group("Comparison");
  add_rows(*sub, render_option_table(command.render));
  add_replay(*sub, command.replay);
  add_rows(*sub, command.training, false);
  add_rows(*sub, command.process);
  return sub;
}

CLI::App* add_command(CLI::App& app, InspectCommand& command) {
  CLI::App* sub = app.add_subcommand("inspect", "Tell what is in a scene (.xml) or a trained warp");
  add_scene(*sub, command.scene);
  add_rows(*sub, command.process);
  return sub;
}

/// As it was typed: words with anything but plain characters in quotes.
std::string as_typed(int argc, const char* const* argv) {
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

std::optional<Command> parse_command_line(int argc, const char* const* argv) {
  CLI::App app{"warpath learns where a Monte Carlo renderer should put its samples"};
  app.set_version_flag("--version", "warpath " WARPATH_VERSION);
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  RenderCommand render;
  TrainCommand train;
  CompareCommand compare;
  InspectCommand inspect;
  compare.typed = as_typed(argc, argv);
  std::optional<Command> chosen;
  const auto add = [&](auto& command) { add_command(app, command)->callback([&] { chosen = command; }); };
  add(render);
  add(train);
  add(compare);
  add(inspect);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) throw ConfigError(error.what());
    app.exit(error);  // prints the help or the version that was asked for
    return std::nullopt;
  }
  return chosen;
}

}  // namespace warpath
