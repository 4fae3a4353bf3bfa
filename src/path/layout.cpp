#include "path/layout.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "warpath/error.h"

namespace warpath {
namespace {

struct KindInfo {
  std::string_view name;
  int size;
  std::uint32_t offset;  // from the start of the camera's or the bounce's numbers
  bool at_bounce;
};
constexpr std::array<KindInfo, 8> kKinds{{{"film", 2, 0, false},
                                          {"lens", 2, 2, false},
                                          {"time", 1, 4, false},
                                          {"light", 1, 0, true},
                                          {"light_uv", 2, 1, true},
                                          {"lobe", 1, 3, true},
                                          {"dir", 2, 4, true},
                                          {"rr", 1, 6, true}}};
const KindInfo& info(GroupKind kind) { return kKinds[static_cast<std::size_t>(kind)]; }

constexpr std::string_view kKnown =
    "film, lens, time, bounceK, bounceK.light, bounceK.light_uv, bounceK.lobe, bounceK.dir, bounceK.rr (K = 1, 2, ...)";

Group parse_group(std::string_view name) {
  const auto unknown = [&] { return ConfigError(fmt::format("unknown dimension \"{}\"; known: {}", name, kKnown)); };
  for (std::size_t k = 0; k < kKinds.size(); ++k)
    if (!kKinds[k].at_bounce && name == kKinds[k].name) return {static_cast<GroupKind>(k), 0};
  constexpr std::string_view prefix = "bounce";
  if (!name.starts_with(prefix)) throw unknown();
  unsigned bounce = 0;
  const char* end = name.data() + name.size();
  const auto [rest, error] = std::from_chars(name.data() + prefix.size(), end, bounce);
  if (error != std::errc() || bounce < 1 || bounce > 1000) throw unknown();
  if (rest == end) return {GroupKind::dir, static_cast<std::uint16_t>(bounce)};
  const std::string_view kind(rest, static_cast<std::size_t>(end - rest));
  for (std::size_t k = 0; k < kKinds.size(); ++k)
    if (kKinds[k].at_bounce && kind.starts_with('.') && kind.substr(1) == kKinds[k].name)
      return {static_cast<GroupKind>(k), static_cast<std::uint16_t>(bounce)};
  throw unknown();
}

}  // namespace

int Group::size() const { return info(kind).size; }

std::uint32_t Group::first_dimension() const {
  return info(kind).offset + (bounce == 0 ? 0 : kCameraDimensions + (bounce - 1u) * kBounceDimensions);
}

std::string Group::name() const {
  return bounce == 0 ? std::string(info(kind).name) : fmt::format("bounce{}.{}", bounce, info(kind).name);
}

Layout Layout::parse(std::string_view names) {
  Layout layout;
  for (std::size_t begin = 0; begin <= names.size();) {
    const std::size_t end = std::min(names.find('+', begin), names.size());
    const Group group = parse_group(names.substr(begin, end - begin));
    if (std::find(layout.m_groups.begin(), layout.m_groups.end(), group) != layout.m_groups.end())
      throw ConfigError(fmt::format("dimension \"{}\" is named twice in \"{}\"", group.name(), names));
    layout.m_groups.push_back(group);
    begin = end + 1;
  }
  std::sort(layout.m_groups.begin(), layout.m_groups.end(),
            [](Group a, Group b) { return a.first_dimension() < b.first_dimension(); });
  for (const Group group : layout.m_groups)
    for (int i = 0; i < group.size(); ++i)
      layout.m_dimensions.push_back(group.first_dimension() + static_cast<std::uint32_t>(i));
  return layout;
}

int Layout::column(Group group) const {
  int column = 0;
  for (const Group g : m_groups) {
    if (g == group) return column;
    column += g.size();
  }
  return -1;
}

std::string Layout::name() const {
  std::string text;
  for (const Group group : m_groups) {
    if (!text.empty()) text += '+';
    text += group.name();
  }
  return text;
}

}  // namespace warpath
