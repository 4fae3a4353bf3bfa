#include "warp/load.h"

#include <array>
#include <charconv>

#include "warp/chain.h"
#include "warp/grid.h"
#include "warp/kdtree.h"
#include "warp/mixture.h"
#include "warp/realnvp.h"
#include "warp/spline.h"
#include "warp/uniform.h"
#include "warpath/error.h"

namespace warpath {
namespace {

struct Family {
  std::string_view name;
  std::shared_ptr<const Proposal> (*load)(const TensorFile&, const std::string&);
};

template <class T>
std::shared_ptr<const Proposal> load_as(const TensorFile& file, const std::string& prefix) {
  return T::load(file, prefix);
}

constexpr std::array kFamilies{Family{"uniform", load_as<Uniform>}, Family{"grid", load_as<Grid>},
                               Family{"kdtree", load_as<KdTree>},   Family{"realnvp", load_as<RealNvp>},
                               Family{"spline", load_as<Spline>},   Family{"chain", load_as<Chain>},
                               Family{"mixture", load_as<Mixture>}};

}  // namespace

std::shared_ptr<const Proposal> load_proposal(const TensorFile& file, const std::string& prefix) {
  const std::string& name = file.meta(prefix + "family");
  std::array<std::string_view, kFamilies.size()> known;
  for (std::size_t k = 0; k < kFamilies.size(); ++k) {
    if (kFamilies[k].name == name) return kFamilies[k].load(file, prefix);
    known[k] = kFamilies[k].name;
  }
  fail_load(file, prefix, fmt::format("unknown family \"{}\";{}", name, suggestion(name, known)));
}

void save_header(TensorFile& file, const std::string& prefix, const Proposal& proposal) {
  file.metadata()[prefix + "family"] = proposal.family();
  file.metadata()[prefix + "dims"] = std::to_string(proposal.dims());
}

int load_dims(const TensorFile& file, const std::string& prefix) {
  const std::string& text = file.meta(prefix + "dims");
  int dims = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), dims);
  if (error != std::errc() || end != text.data() + text.size() || dims < 1 || dims > kMaxDims)
    fail_load(file, prefix, fmt::format("\"{}\" dimensions, not 1 to {}", text, kMaxDims));
  return dims;
}

void fail_load(const TensorFile& file, const std::string& prefix, std::string_view what) {
  throw FileError(fmt::format("{}: {}: {}", file.path().string(), prefix, what));
}

}  // namespace warpath
