#include "cli/density_pictures.h"

#include <tuple>

#include "train/marginals.h"

namespace warpath {
namespace {

constexpr int kBins = 64;
constexpr std::uint64_t kSamples = 1 << 20;

/// Name of each column of y: `film.x`, `bounce1.dir.u`, `bounce1.lobe`.
std::vector<std::string> column_names(const Layout& layout) {
  std::vector<std::string> names;
  for (const Group group : layout.groups()) {
    const bool film = group.kind == GroupKind::film;
    if (group.size() == 1) {
      names.push_back(group.name());
    } else {
      names.push_back(group.name() + (film ? ".x" : ".u"));
      names.push_back(group.name() + (film ? ".y" : ".v"));
    }
  }
  return names;
}

}  // namespace

std::vector<DensityPicture> density_pictures(const Method& method, const Preparation& preparation) {
  std::vector<DensityPicture> pictures;
  if (!preparation.candidates || !preparation.proposal) return pictures;
  // Columns in pairs: both numbers of a group where it has two, else it and the first one of the next group, or, where
  // there is none, the x of the film and it.
  const std::vector<std::string> names = column_names(method.layout);
  const auto grid = [](Marginal marginal) { return DensityGrid{kBins, kBins, std::move(marginal.density)}; };
  for (const Group group : method.layout.groups()) {
    int x = method.layout.column(group), y = x + 1;
    if (y >= method.layout.dims()) std::tie(x, y) = std::pair(0, x);
    if (x == y) continue;
    pictures.push_back({method.name, names[static_cast<std::size_t>(x)], names[static_cast<std::size_t>(y)], "",
                        grid(proposal_marginal(*preparation.proposal, x, y, kBins, kSamples)),
                        grid(target_marginal(*preparation.candidates, x, y, kBins))});
  }
  return pictures;
}

}  // namespace warpath
