#include "render/method.h"

#include "family/warp_file.h"
#include "path/pass_record.h"
#include "warp/vertex_decision.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr char kAuto[] = "auto";
constexpr char kAutoFamily[] = "field";
constexpr std::string_view kDefaultDimensions = "film+bounce1";

Method of_file(const std::string& text) {
  const auto names = method_names();
  if (!std::filesystem::exists(text))
    throw ConfigError(fmt::format(
        "unknown warp \"{}\", neither a family nor a file;{}", text,
        suggestion(text.substr(0, text.find(':')), std::vector<std::string_view>(names.begin(), names.end()))));
  const WarpFile file = load_warp(text);
  return {.name = text, .family = find_family(family_of(file)), .layout = file.layout, .file = text};
}

Layout vertex_layout(const std::string& text, const Family& family, std::string_view dims) {
  const Layout layout = dims.empty() ? Layout() : Layout::parse(dims);
  if (dims.empty() && !family.at_vertices()->every_vertex)
    throw ConfigError(fmt::format("\"{}\": which numbers? {}:bounce1.lobe+bounce1, for example", text, family.name));
  try {
    check_decisions(layout);
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("\"{}\": {}", text, error.what()));
  }
  return layout;
}

Layout joint_layout(const std::string& text, const Family& family, std::string_view dims) {
  const Layout layout = Layout::parse(dims.empty() ? kDefaultDimensions : dims);
  // What families of this name were over the numbers of a vertex.
  if (const std::string conditional = "conditional-" + family.name; find_family(conditional) && are_decisions(layout))
    throw ConfigError(
        fmt::format("\"{}\": a density for each place on the film is called {}:{}", text, conditional, layout.name()));
  return layout;
}

}  // namespace

std::string Method::family_name() const { return automatic ? kAuto : family ? family->name : kNoWarp; }

std::string Method::trained_family() const { return family && file.empty() ? family->name : kNoWarp; }

Method parse_method(const std::string& text) {
  const std::size_t colon = text.find(':');
  const std::string name = text.substr(0, colon);
  const std::string_view dims = colon == std::string::npos ? "" : std::string_view(text).substr(colon + 1);
  if (colon != std::string::npos && dims.empty())
    throw ConfigError(fmt::format("\"{}\": no dimensions after the colon", text));
  if (name == kNoWarp) {
    if (!dims.empty())
      throw ConfigError(fmt::format("\"{}\": `none` has no dimensions; uniform:{} draws those at random", text, dims));
    return {.name = text};
  }
  if (name == kAuto) {
    if (!dims.empty()) throw ConfigError(fmt::format("\"{}\": auto has no dimensions to choose", text));
    return {.name = text, .family = find_family(kAutoFamily), .automatic = true};
  }
  const Family* family = find_family(name);
  if (!family || family->is_container()) return of_file(text);
  const Layout layout = family->joint() ? joint_layout(text, *family, dims) : vertex_layout(text, *family, dims);
  return {.name = text, .family = family, .layout = layout};
}

std::vector<std::string> method_names() {
  std::vector<std::string> names{kNoWarp};
  for (std::string& name : family_names([](const Family& f) { return !f.is_container(); }))
    names.push_back(std::move(name));
  names.emplace_back(kAuto);
  return names;
}

}  // namespace warpath
