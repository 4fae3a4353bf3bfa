#include "warp/load.h"

#include <charconv>

#include "warpath/error.h"

namespace warpath {

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
