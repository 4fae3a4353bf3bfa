#include <CLI/CLI.hpp>

#include "cli/commands.h"
#include "warpath/error.h"

// The only file that knows how options are spelled, and the only one that includes CLI11, which is slow to compile.
namespace warpath {
namespace {

void add_options(CLI::App& app, CommonOptions& options) {
  app.add_option("--size", options.size, "Size of the film, whatever the scene's parameters are called")
      ->type_name("WxH");
  app.add_option("-D", options.defines, "Value of a parameter of the scene")
      ->type_name("name=value")
      ->allow_extra_args(false);
  app.add_option("--max-depth", options.max_depth,
                 "Longest path, counted as Mitsuba does (1: directly seen emission only)")
      ->check(CLI::PositiveNumber);
  app.add_option("--seed", options.seed, "Same seed, same image, for any number of threads")->capture_default_str();
  app.add_option("--threads", options.threads, "Threads to use (default: all)")->check(CLI::PositiveNumber);
  auto* loud = app.add_flag("--verbose", options.verbose, "Tell more");
  app.add_flag("--quiet", options.quiet, "Show warnings and errors only")->excludes(loud);
}

void add_options(CLI::App& app, TrainingOptions& options) {
  constexpr auto kGroup = "Training";
  const auto add = [&](const char* name, auto& value, const char* help) {
    return app.add_option(name, value, help)->group(kGroup)->capture_default_str();
  };
  auto* by_epp = add("--epp", options.epp, "Training examples: K x 200 x 160")->check(CLI::PositiveNumber);
  app.add_option("--examples", options.examples, "Training examples, as a number")
      ->group(kGroup)
      ->check(CLI::PositiveNumber)
      ->excludes(by_epp);
  add("--alpha", options.settings.alpha, "Candidates for each example, resampled by what they contribute")
      ->check(CLI::Range(1.0, 1e6));
  add("--uniform", options.settings.uniform, "Share of uniform samples in the mixture; keeps weights bounded")
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--init", options.init, "Start training from this warp")->group(kGroup)->check(CLI::ExistingFile);
  add("--training-samples", options.training_samples,
      "Whether candidates count in the image: discard (as the paper does) or use")
      ->check(CLI::IsMember({"discard", "use"}));

  constexpr auto kFlow = "Real NVP and spline";
  const auto add_flow = [&](const char* name, auto& value, const char* help) {
    return app.add_option(name, value, help)->group(kFlow);
  };
  const RealNvpSettings& nvp = options.settings.realnvp;
  const SplineSettings& spline = options.settings.spline;
  const auto defaults = [](const char* help, auto of_nvp, auto of_spline) {
    return fmt::format("{} [{}; spline: {}]", help, of_nvp, of_spline);
  };
  const auto add_sized = [&](const char* name, auto& value, const char* help, auto of_nvp, auto of_spline) {
    return add_flow(name, value, defaults(help, of_nvp, of_spline).c_str());
  };
  add_sized("--couplings", options.couplings, "Coupling layers", nvp.couplings, spline.couplings)
      ->check(CLI::Range(1, 64));
  add_sized("--width", options.width, "Neurons in each hidden layer", nvp.width, spline.width)
      ->check(CLI::Range(1, 1024));
  add_sized("--blocks", options.blocks, "Residual blocks in each network", nvp.blocks, spline.blocks)
      ->check(CLI::Range(0, 64));
  add_sized("--encoding-bins", options.encoding_bins, "Bins of the one-blob encoding of what the networks see; 0: none",
            nvp.encoding_bins, spline.encoding_bins)
      ->check(CLI::Range(0, 256));
  add_sized("--rate", options.rate, "Step size of Adam", nvp.rate, spline.rate)->check(CLI::PositiveNumber);
  add_sized("--jitter", options.jitter,
            "How far examples are moved each time they are shown, times the root of their number", nvp.jitter,
            spline.jitter)
      ->check(CLI::Range(0.0, 10.0));
  add_sized("--batch", options.batch, "Examples in a training step", nvp.batch, spline.batch)
      ->check(CLI::Range(64, 1 << 20));
  add_sized("--max-steps", options.max_steps, "Training steps at most", nvp.max_steps, spline.max_steps)
      ->check(CLI::NonNegativeNumber);
  add_flow("--loss", options.loss,
           "What training minimises: variance of the estimate, or likelihood, as the paper does")
      ->capture_default_str()
      ->check(CLI::IsMember({"variance", "likelihood"}));

  constexpr auto kNvp = "Real NVP";
  const auto add_nvp = [&](const char* name, auto& value, const char* help) {
    return app.add_option(name, value, help)->group(kNvp)->capture_default_str();
  };
  add_nvp("--architecture", options.architecture,
          "default, or released: the authors' 12 couplings of 512 x 8, with their rate")
      ->check(CLI::IsMember({"default", "released"}));
  add_nvp("--masks", options.masks, "What a coupling moves: alternating dimensions, or binary, halves that change")
      ->check(CLI::IsMember({"alternating", "binary"}));
  add_nvp("--networks", options.networks, "shared: s and t from one network; separate, as the paper has them")
      ->check(CLI::IsMember({"shared", "separate"}));
  add_nvp("--bn", options.bn, "Normalisation: none, actnorm, or batch (as the paper has it)")
      ->check(CLI::IsMember({"none", "actnorm", "batch"}));

  app.add_option("--cells", options.settings.field.max_cells, "Cells of the field at most; each takes about 5 KB")
      ->group("Field")
      ->capture_default_str()
      ->check(CLI::Range(1, 1 << 24));

  constexpr auto kTree = "kd-tree, grid and spline";
  app.add_option("--kdtree-target", options.kdtree_target,
                 "A cell's density follows: mean g, or rms, the root of its mean square")
      ->group(kTree)
      ->capture_default_str()
      ->check(CLI::IsMember({"mean", "rms"}));
  app.add_option("--kdtree-split", options.kdtree_split,
                 "best, wherever a split gains most, or cyclic: dimensions in turn, as Guo et al. do")
      ->group(kTree)
      ->capture_default_str()
      ->check(CLI::IsMember({"best", "cyclic"}));
  app.add_option("--leaves", options.settings.kdtree.max_leaves, "Leaves of the kd-tree at most")
      ->group(kTree)
      ->capture_default_str()
      ->check(CLI::Range(1, 1 << 24));
  app.add_option("--bins", options.bins,
                 fmt::format("Intervals of the grid in each dimension [{}]; bins of each spline, 2 to 64 [{}]",
                             options.settings.grid.bins, options.settings.spline.bins))
      ->group(kTree)
      ->check(CLI::Range(1, 1 << 16));
}

void add_options(CLI::App& app, RenderOptions& options) {
  auto* by_samples =
      app.add_option("--spp", options.spp, "Samples per pixel (default: the scene's)")->check(CLI::Range(1, 1 << 24));
  auto* by_time = app.add_option("--time", options.time, "Seconds for everything after loading, training included")
                      ->check(CLI::PositiveNumber)
                      ->excludes(by_samples);
  app.add_option("--replay", options.replay,
                 "results.json of runs under --time: renders the passes of the run with the same method, seed and size")
      ->check(CLI::ExistingFile)
      ->excludes(by_samples)
      ->excludes(by_time);
  app.add_option(
         "--objective", options.objective_name,
         "The error that samples are placed to lessen where the film is stratified: mse, relmse, or even for as "
         "many in every pixel; `none` has them even")
      ->capture_default_str()
      ->check(CLI::IsMember({"mse", "relmse", "even"}));
  app.add_option(
         "--sampler", options.sampler_name,
         "How the numbers of a pixel's samples are spread, where the film is not warped: independent, stratified "
         "or sobol [independent]")
      ->check(CLI::IsMember({"independent", "stratified", "sobol"}));
  app.add_option("--crop", options.crop, "Part of the film to render")->type_name("X,Y,W,H");
}

CLI::App* add_command(CLI::App& app, RenderCommand& command) {
  CLI::App* sub = app.add_subcommand("render", "Render a scene");
  sub->add_option("scene", command.common.scene, "Mitsuba 3 scene file")->required();
  sub->add_option("-o,--output", command.output, "Image to write: .exr (with variance), .png, .jpg")
      ->capture_default_str();
  sub->add_option(
         "--warp", command.warp,
         "FAMILY[:DIMS] or a trained warp's file; families: none, uniform, grid, kdtree, realnvp, spline, field, "
         "auto")
      ->capture_default_str();
  add_options(*sub, command.render);
  sub->add_option("--aov", command.render.aov, "Further layers: albedo, normal, depth")->type_name("LIST");
  add_options(*sub, command.common);
  add_options(*sub, command.training);
  return sub;
}

CLI::App* add_command(CLI::App& app, TrainCommand& command) {
  CLI::App* sub = app.add_subcommand("train", "Train a warp and save it");
  sub->add_option("scene", command.common.scene, "Mitsuba 3 scene file")->required();
  sub->add_option("--warp", command.warp, "FAMILY[:DIMS]: grid, kdtree, realnvp or spline; or field")->required();
  sub->add_option("-o,--output", command.output, "File to write (safetensors)")->required();
  add_options(*sub, command.common);
  add_options(*sub, command.training);
  return sub;
}

CLI::App* add_command(CLI::App& app, CompareCommand& command) {
  CLI::App* sub = app.add_subcommand("compare", "Render a scene by several methods, and report what each gains");
  sub->add_option("scene", command.common.scene, "Mitsuba 3 scene file")->required();
  sub->add_option("--methods", command.methods, "Each none, FAMILY[:DIMS] or a trained warp's file")
      ->delimiter(',')
      ->capture_default_str();
  sub->add_option("--report", command.directory, "Folder for images, results.json and index.html")->required();
  sub->add_option("--runs", command.runs, "Repetitions with seeds that follow each other")
      ->capture_default_str()
      ->check(CLI::Range(1, 10000));
  sub->add_flag("--resume", command.resume,
                "Keep the runs that an interrupted call of the same command left in the report's folder");
  auto* given = sub->add_option("--reference", command.reference,
                                "Image to measure against (ref.variance.exr beside it is its noise)")
                    ->check(CLI::ExistingFile);
  sub->add_option("--reference-spp", command.reference_spp,
                  "Samples of the reference that is rendered where none is given (default: 8 x spp)")
      ->check(CLI::Range(1, 1 << 24))
      ->excludes(given);
  add_options(*sub, command.render);
  add_options(*sub, command.common);
  add_options(*sub, command.training);
  return sub;
}

CLI::App* add_command(CLI::App& app, InspectCommand& command) {
  CLI::App* sub = app.add_subcommand("inspect", "Tell what is in a scene or a trained warp");
  sub->add_option("file", command.common.scene, "Scene file (.xml) or warp")->required()->check(CLI::ExistingFile);
  add_options(*sub, command.common);
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
