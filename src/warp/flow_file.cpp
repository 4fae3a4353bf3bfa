#include "warp/flow_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "warp/load.h"
#include "warp/spline_kernels.h"
#include "warpath/error.h"

namespace warpath {
namespace {

std::vector<std::int64_t> shape_of(const ParameterView& view) {
  const std::int64_t rows = static_cast<std::int64_t>(view.rows), cols = static_cast<std::int64_t>(view.cols);
  return view.name.ends_with(".weight") ? std::vector{rows, cols} : std::vector{rows};
}

}  // namespace

int load_int(const TensorFile& file, const std::string& prefix, const char* key, int least, int most) {
  const std::string& text = file.meta(prefix + key);
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < least || value > most)
    fail_load(file, prefix, fmt::format("{} \"{}\", not {} to {}", key, text, least, most));
  return value;
}

void save_settings(TensorFile& file, const std::string& prefix, const SplineSettings& s) {
  auto& meta = file.metadata();
  meta[prefix + "couplings"] = std::to_string(s.couplings);
  meta[prefix + "width"] = std::to_string(s.width);
  meta[prefix + "blocks"] = std::to_string(s.blocks);
  meta[prefix + "bins"] = std::to_string(s.bins);
  meta[prefix + "encoding_bins"] = std::to_string(s.encoding_bins);
  meta[prefix + "masks"] = s.masks == SplineSettings::Masks::binary ? "binary" : "autoregressive";
}

SplineSettings load_spline_settings(const TensorFile& file, const std::string& prefix) {
  SplineSettings s;
  s.couplings = load_int(file, prefix, "couplings", 1, 1000);
  s.width = load_int(file, prefix, "width", 16, 8192);
  s.blocks = load_int(file, prefix, "blocks", 0, 100);
  s.bins = load_int(file, prefix, "bins", 2, spline::kMostBins);
  s.encoding_bins = load_int(file, prefix, "encoding_bins", 0, 256);
  const std::string& masks = file.meta(prefix + "masks");
  if (masks != "binary" && masks != "autoregressive")
    fail_load(file, prefix, fmt::format("masks \"{}\", not binary or autoregressive", masks));
  if (masks == "autoregressive") s.masks = SplineSettings::Masks::autoregressive;
  if (s.width % 16 != 0) fail_load(file, prefix, fmt::format("width {}: not a multiple of 16", s.width));
  return s;
}

void save_parameters(TensorFile& file, const std::string& prefix, const CouplingFlow& flow,
                     const nn::AlignedVector<float>& parameters) {
  std::vector<float> values;
  for (const ParameterView& view : flow.views()) {
    values.clear();
    for (std::size_t r = 0; r < view.rows; ++r)
      for (std::size_t c = 0; c < view.cols; ++c) values.push_back(parameters[view.offset + r * view.stride + c]);
    file.put<float>(prefix + view.name, shape_of(view), values);
  }
}

nn::AlignedVector<float> load_parameters(const TensorFile& file, const std::string& prefix, const CouplingFlow& flow) {
  const auto views = flow.views();
  for (const ParameterView& view : views) {  // before anything is allocated
    const auto entry = file.entries().find(prefix + view.name);
    if (entry == file.entries().end()) fail_load(file, prefix, fmt::format("no tensor \"{}\"", view.name));
    if (entry->second.shape != shape_of(view))
      fail_load(file, prefix,
                fmt::format("{} is {}, not {}", view.name, fmt::join(entry->second.shape, " x "),
                            fmt::join(shape_of(view), " x ")));
  }
  nn::AlignedVector<float> parameters(flow.parameter_count(), 0.0f);
  for (const ParameterView& view : views) {
    const auto stored = file.get<float>(prefix + view.name);
    for (std::size_t r = 0; r < view.rows; ++r)
      std::copy_n(stored.values.data() + r * view.cols, view.cols, parameters.data() + view.offset + r * view.stride);
  }
  if (!std::all_of(parameters.begin(), parameters.end(), [](float p) { return std::isfinite(p); }))
    fail_load(file, prefix, "its weights are not all finite");
  return parameters;
}

}  // namespace warpath
