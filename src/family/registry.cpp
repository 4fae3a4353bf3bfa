#include <algorithm>
#include <vector>

#include "family/family.h"
#include "warp/load.h"
#include "warpath/error.h"

// Every family has a line here, and a file that defines NAME_family().
#define WARPATH_FAMILIES(X) \
  X(uniform)                \
  X(grid)                   \
  X(kdtree)                 \
  X(realnvp)                \
  X(spline)                 \
  X(field)                  \
  X(conditional_kdtree)     \
  X(conditional_spline)     \
  X(chain)                  \
  X(mixture)

namespace warpath {

#define WARPATH_DECLARE(name) Family name##_family();
WARPATH_FAMILIES(WARPATH_DECLARE)

namespace {

std::deque<Family>& registry() {
#define WARPATH_MAKE(name) name##_family(),
  static std::deque<Family> all{WARPATH_FAMILIES(WARPATH_MAKE)};
  return all;
}

}  // namespace

const std::deque<Family>& families() { return registry(); }

const Family* find_family(std::string_view name) {
  const auto& all = registry();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Family& f) { return f.name == name; });
  return found == all.end() ? nullptr : &*found;
}

void register_family(Family family) {
  WARPATH_CHECK(!find_family(family.name));
  registry().push_back(std::move(family));
}

std::vector<std::string> family_names(const std::function<bool(const Family&)>& among) {
  std::vector<std::string> names;
  for (const Family& family : families())
    if (among(family)) names.push_back(family.name);
  return names;
}

std::shared_ptr<const Proposal> load_proposal(const TensorFile& file, const std::string& prefix) {
  const std::string& name = file.meta(prefix + "family");
  const Family* family = find_family(name);
  if (family && family->joint()) return family->joint()->load(file, prefix);
  if (family && family->is_container()) return std::get<Container>(family->kind).load(file, prefix);
  const auto names = family_names([](const Family& f) { return !f.at_vertices(); });
  const std::vector<std::string_view> known(names.begin(), names.end());
  fail_load(file, prefix, fmt::format("unknown family \"{}\";{}", name, suggestion(name, known)));
}

}  // namespace warpath
