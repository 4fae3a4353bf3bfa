#include "warp/vertex_decision.h"

#include <fmt/format.h>

#include "core/tensor_file.h"
#include "warp/load.h"
#include "warpath/error.h"

namespace warpath {

void check_decisions(const Layout& numbers) {
  for (const Group group : numbers.groups()) {
    const bool of_light = group.kind == GroupKind::light || group.kind == GroupKind::light_uv;
    if (!of_light && group.kind != GroupKind::lobe && group.kind != GroupKind::dir)
      throw ConfigError(
          fmt::format("{} is not a number that a warp of vertices draws; those are light, light_uv, lobe "
                      "and dir of a bounce",
                      group.name()));
    const Group first{of_light ? GroupKind::light : GroupKind::lobe, group.bounce};
    const Group second{of_light ? GroupKind::light_uv : GroupKind::dir, group.bounce};
    if (!numbers.contains(first) || !numbers.contains(second))
      throw ConfigError(
          fmt::format("{} is drawn as one with its other half: name {}+{}", group.name(), first.name(), second.name()));
  }
}

bool are_decisions(const Layout& numbers) {
  if (numbers.dims() == 0) return false;
  try {
    check_decisions(numbers);
    return true;
  } catch (const ConfigError&) {
    return false;
  }
}

bool holds_decision(const Layout& numbers, VertexDecision which, std::uint16_t bounce) {
  return numbers.dims() == 0 ||
         numbers.contains({which == VertexDecision::light_sampling ? GroupKind::light : GroupKind::lobe, bounce});
}

Layout load_decisions(const TensorFile& file, const std::string& prefix) {
  Layout numbers;
  const std::string& text = file.meta(prefix + "numbers");
  if (text.empty()) return numbers;
  try {
    numbers = Layout::parse(text);
    check_decisions(numbers);
  } catch (const ConfigError& error) {
    fail_load(file, prefix, error.what());
  }
  return numbers;
}

}  // namespace warpath
