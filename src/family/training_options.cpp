#include "family/training_options.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "family/family.h"
#include "warpath/error.h"

namespace warpath {
namespace {

// Users that stand for several families: those that are fitted to candidates, and any that is trained by itself.
constexpr char kFitted[] = "fitted";
constexpr char kTrained[] = "trained";

// What options were called: all of that name, and that of one family.
struct Renamed {
  const char *before, *now;
};
constexpr Renamed kUniform{"uniform", "uniform-share"}, kGridBins{"bins", "intervals"};
constexpr char kGrid[] = "grid";

bool is_user(const Family& family, const std::string& user, bool trained) {
  if (user == kFitted) return family.joint() && family.joint()->learns();
  if (user == kTrained) return trained && family.learns();
  return family.name == user;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Examples as the paper counts them, k x 200 x 160.
OptionValue epp(TrainSettings& s) {
  const auto k = std::make_shared<double>(16);
  OptionValue value = above(0, *k, 1e6);
  value.set = [k, &s, set = value.set](const std::string& text) {
    set(text);
    s.examples = static_cast<std::uint64_t>(std::max(1.0, std::round(*k * 200 * 160)));
  };
  value.get = [k, get = value.get] { return get(); };
  return value;
}

OptionValue architecture(TrainSettings& s) {
  const auto released = std::make_shared<bool>(false);
  OptionValue value = one_of(*released, {{"default", false}, {"released", true}});
  value.set = [released, &s, set = value.set](const std::string& text) {
    set(text);
    s.realnvp = *released ? released_realnvp() : RealNvpSettings();
  };
  value.get = [released, get = value.get] { return get(); };
  return value;
}

OptionValue loss(FlowTraining& flow) {
  return one_of(flow.loss,
                {{"variance", FlowTraining::Loss::variance}, {"likelihood", FlowTraining::Loss::likelihood}});
}

void add_examples(std::vector<Option>& rows, TrainSettings& s) {
  constexpr char kGroup[] = "Training";
  const auto all = [](const OptionValue& value) { return std::vector<OptionUse>{{kFitted, value}, {kTrained, value}}; };
  rows.push_back({"epp", kGroup, "Training examples: K x 200 x 160", all(epp(s))});
  rows.push_back({"examples",
                  kGroup,
                  "Training examples, as a number",
                  all(whole(s.examples, 1, std::uint64_t{10'000'000'000})),
                  {"epp"}});
  rows.push_back(
      {"alpha", kGroup, "Candidates for each example, resampled by what they contribute", all(real(s.alpha, 1, 1e6))});
  rows.push_back({"uniform-share",
                  kGroup,
                  "Share of uniform samples in the mixture; keeps weights bounded",
                  {{kFitted, real(s.uniform_share, 0, 0.999)},
                   {"conditional-kdtree", real(s.uniform_share, 0, 0.999)},
                   {"conditional-spline", real(s.uniform_share, 0, 0.999)}}});
  rows.push_back({"init",
                  kGroup,
                  "Start from this warp",
                  {{"grid", existing_file(s.init)},
                   {"realnvp", existing_file(s.init)},
                   {"spline", existing_file(s.init)},
                   {"field", existing_file(s.init)}}});
  rows.push_back({"training-samples",
                  kGroup,
                  "Whether candidates count in the image: discard (as the paper does) or use",
                  {{kFitted, one_of(s.candidates_count, {{"discard", false}, {"use", true}})}}});
}

void add_flows(std::vector<Option>& rows, TrainSettings& s) {
  constexpr char kGroup[] = "Real NVP and spline flows";
  RealNvpSettings& nvp = s.realnvp;
  SplineSettings &spline = s.spline, &conditional = s.conditional_spline.flow;
  const auto whole_of_flows = [&](int& of_nvp, int& of_spline, int& of_conditional, int low, int high) {
    return std::vector<OptionUse>{{"realnvp", whole(of_nvp, low, high)},
                                  {"spline", whole(of_spline, low, high)},
                                  {"conditional-spline", whole(of_conditional, low, high)}};
  };
  // First: it sets what the rows below may change.
  rows.push_back({"architecture",
                  kGroup,
                  "default, or released: the authors' 12 couplings of 512 x 8, with their rate",
                  {{"realnvp", architecture(s)}}});
  rows.push_back({"couplings", kGroup, "Coupling layers",
                  whole_of_flows(nvp.couplings, spline.couplings, conditional.couplings, 1, 64)});
  rows.push_back({"width", kGroup, "Neurons in each hidden layer",
                  whole_of_flows(nvp.width, spline.width, conditional.width, 1, 1024)});
  rows.push_back({"blocks", kGroup, "Residual blocks in each network",
                  whole_of_flows(nvp.blocks, spline.blocks, conditional.blocks, 0, 64)});
  rows.push_back({"encoding-bins", kGroup, "Bins of the one-blob encoding of what the networks see; 0: none",
                  whole_of_flows(nvp.encoding_bins, spline.encoding_bins, conditional.encoding_bins, 0, 256)});
  rows.push_back({"rate",
                  kGroup,
                  "Step size of Adam",
                  {{"realnvp", above(0, nvp.rate, 1)},
                   {"spline", above(0, spline.rate, 1)},
                   {"conditional-spline", above(0, conditional.rate, 1)}}});
  rows.push_back({"batch", kGroup, "Examples in a training step",
                  whole_of_flows(nvp.batch, spline.batch, conditional.batch, 64, 1 << 20)});
  rows.push_back({"max-steps",
                  kGroup,
                  "Training steps at most",
                  {{"realnvp", whole(nvp.max_steps, 0, 1 << 30)}, {"spline", whole(spline.max_steps, 0, 1 << 30)}}});
  rows.push_back({"jitter",
                  kGroup,
                  "How far examples are moved each time they are shown, times the root of their number",
                  {{"realnvp", real(nvp.jitter, 0, 10)}, {"spline", real(spline.jitter, 0, 10)}}});
  rows.push_back({"loss",
                  kGroup,
                  "What training minimises: variance of the estimate, or likelihood, as the paper does",
                  {{"realnvp", loss(nvp)}, {"spline", loss(spline)}, {"conditional-spline", loss(conditional)}}});
  using Masks = RealNvpSettings::Masks;
  using Norm = RealNvpSettings::Norm;
  rows.push_back({"masks",
                  kGroup,
                  "What a coupling moves: alternating dimensions, or binary, halves that change",
                  {{"realnvp", one_of(nvp.masks, {{"alternating", Masks::alternating}, {"binary", Masks::binary}})}}});
  rows.push_back({"networks",
                  kGroup,
                  "shared: s and t from one network; separate, as the paper has them",
                  {{"realnvp", one_of(nvp.shared, {{"shared", true}, {"separate", false}})}}});
  rows.push_back(
      {"bn",
       kGroup,
       "Normalisation: none, actnorm, or batch (as the paper has it)",
       {{"realnvp", one_of(nvp.norm, {{"none", Norm::none}, {"actnorm", Norm::actnorm}, {"batch", Norm::batch}})}}});
}

void add_trees(std::vector<Option>& rows, TrainSettings& s) {
  constexpr char kGroup[] = "Grid, kd-tree, splines and field";
  using Target = KdTreeSettings::Target;
  using Split = KdTreeSettings::Split;
  rows.push_back({"intervals",
                  kGroup,
                  "Intervals of the grid in each dimension",
                  {{"grid", whole(s.grid.intervals, 1, 100'000)}}});
  rows.push_back({"bins",
                  kGroup,
                  "Bins of each spline",
                  {{"spline", whole(s.spline.bins, 2, 64)},
                   {"conditional-spline", whole(s.conditional_spline.flow.bins, 2, 64)}}});
  rows.push_back({"kdtree-target",
                  kGroup,
                  "A cell's density follows: mean g, or rms, the root of its mean square",
                  {{"kdtree", one_of(s.kdtree.target, {{"mean", Target::mean}, {"rms", Target::second_moment}})}}});
  rows.push_back({"kdtree-split",
                  kGroup,
                  "best, wherever a split gains most, or cyclic: dimensions in turn, as Guo et al. do",
                  {{"kdtree", one_of(s.kdtree.split, {{"best", Split::best}, {"cyclic", Split::cyclic}})}}});
  rows.push_back(
      {"leaves", kGroup, "Leaves of the kd-tree at most", {{"kdtree", whole(s.kdtree.max_leaves, 1, 1 << 24)}}});
  rows.push_back({"cells",
                  kGroup,
                  "Cells of the field at most; each takes about 5 KB",
                  {{"field", whole(s.field.max_cells, 1, 1 << 24)}}});
}

}  // namespace

std::vector<Option> training_option_table(TrainSettings& settings) {
  std::vector<Option> rows;
  add_examples(rows, settings);
  add_flows(rows, settings);
  add_trees(rows, settings);
  return rows;
}

std::vector<std::string> users_of(const Option& option, bool trained) {
  return family_names([&](const Family& family) {
    return std::any_of(option.uses.begin(), option.uses.end(),
                       [&](const OptionUse& use) { return is_user(family, use.user, trained); });
  });
}

std::string TrainingOptions::spelled(const std::string& name) const {
  return m_spelling == Spelling::command_line ? "--" + name : python_name(name);
}

void TrainingOptions::set(const std::string& name, const std::string& text) {
  const std::string dashed = option_name(name);
  if (dashed == kUniform.before)
    throw ConfigError(fmt::format("{} is now called {}", spelled(dashed), spelled(kUniform.now)));
  TrainSettings scratch;
  const auto table = training_option_table(scratch);
  const Option& option = find_option(table, dashed);
  option.set(text, spelled(dashed));
  for (const auto& [other, value] : m_given)
    if (contains(option.excludes, other) || contains(find_option(table, other).excludes, dashed))
      throw ConfigError(fmt::format("{} excludes {}", spelled(dashed), spelled(other)));
  m_given.emplace_back(dashed, text);
}

void TrainingOptions::check_used(const std::vector<std::string>& families, bool trained) const {
  TrainSettings scratch;
  const auto table = training_option_table(scratch);
  for (const auto& [name, text] : m_given) {
    const auto users = users_of(find_option(table, name), trained);
    const auto uses = [&](const std::string& family) { return contains(users, family); };
    if (std::any_of(families.begin(), families.end(), uses)) continue;
    if (name == kGridBins.before && contains(families, kGrid))
      throw ConfigError(fmt::format("{} of a grid is now called {}", spelled(name), spelled(kGridBins.now)));
    throw ConfigError(fmt::format("{}: {} {} not use it; it is for {}", spelled(name), fmt::join(families, ", "),
                                  families.size() == 1 ? "does" : "do", alternatives(users)));
  }
}

TrainSettings TrainingOptions::settings(std::uint64_t seed) const {
  TrainSettings settings;
  settings.seed = seed;
  const auto table = training_option_table(settings);
  for (const Option& option : table)
    for (const auto& [name, text] : m_given)
      if (name == option.name) option.set(text, spelled(name));
  return settings;
}

}  // namespace warpath
