#include "warp/realnvp.h"

#include <algorithm>
#include <array>

#include "core/tensor_file.h"
#include "warp/flow_file.h"
#include "warp/load.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::array<std::string_view, 2> kMasks{"alternating", "binary"};
constexpr std::array<std::string_view, 3> kNorms{"none", "actnorm", "batch"};

template <class Enum, std::size_t N>
Enum load_enum(const TensorFile& file, const std::string& prefix, const char* key,
               const std::array<std::string_view, N>& names) {
  const std::string& text = file.meta(prefix + key);
  const auto found = std::find(names.begin(), names.end(), text);
  if (found == names.end()) fail_load(file, prefix, fmt::format("unknown {} \"{}\"", key, text));
  return static_cast<Enum>(found - names.begin());
}

}  // namespace

RealNvp::RealNvp(realnvp::Flow flow, nn::AlignedVector<float> parameters)
    : m_flow(std::move(flow)), m_parameters(std::move(parameters)) {
  WARPATH_CHECK_EQ(m_parameters.size(), m_flow.parameter_count());
  m_flow.pack(m_parameters.data(), m_packed, false);
}

std::shared_ptr<const RealNvp> RealNvp::untrained(int dims, const RealNvpSettings& settings, std::uint64_t seed) {
  realnvp::Flow flow(dims, settings);
  auto parameters = flow.initial(seed);
  return std::make_shared<RealNvp>(std::move(flow), std::move(parameters));
}

void RealNvp::forward(Batch<const double> z, Batch<double> y, std::span<double> log_det) const {
  run_flow(m_flow, m_packed, true, z, y, log_det);
}

void RealNvp::inverse(Batch<const double> y, Batch<double> z, std::span<double> log_det) const {
  run_flow(m_flow, m_packed, false, y, z, log_det);
}

void RealNvp::save(TensorFile& file, const std::string& prefix) const {
  save_header(file, prefix, *this);
  auto& meta = file.metadata();
  const RealNvpSettings& s = settings();
  meta[prefix + "couplings"] = std::to_string(s.couplings);
  meta[prefix + "width"] = std::to_string(s.width);
  meta[prefix + "blocks"] = std::to_string(s.blocks);
  meta[prefix + "shared"] = std::to_string(s.shared ? 1 : 0);
  meta[prefix + "bins"] = std::to_string(s.encoding_bins);
  meta[prefix + "masks"] = kMasks[static_cast<std::size_t>(s.masks)];
  meta[prefix + "norm"] = kNorms[static_cast<std::size_t>(s.norm)];
  save_parameters(file, prefix, m_flow, m_parameters);
}

std::shared_ptr<const RealNvp> RealNvp::load(const TensorFile& file, const std::string& prefix) {
  const int dims = load_dims(file, prefix);
  RealNvpSettings s;
  s.couplings = load_int(file, prefix, "couplings", 1, 1000);
  s.width = load_int(file, prefix, "width", 16, 8192);
  s.blocks = load_int(file, prefix, "blocks", 0, 100);
  s.shared = load_int(file, prefix, "shared", 0, 1) == 1;
  s.encoding_bins = load_int(file, prefix, "bins", 0, 256);
  s.masks = load_enum<RealNvpSettings::Masks>(file, prefix, "masks", kMasks);
  s.norm = load_enum<RealNvpSettings::Norm>(file, prefix, "norm", kNorms);
  if (s.width % 16 != 0) fail_load(file, prefix, fmt::format("width {}: not a multiple of 16", s.width));

  realnvp::Flow flow(dims, s);
  auto parameters = load_parameters(file, prefix, flow);
  for (const ParameterView& view : flow.views())
    if (view.name.ends_with("variance") &&
        std::any_of(&parameters[view.offset], &parameters[view.offset] + view.rows, [](float v) { return v < 0; }))
      fail_load(file, prefix, fmt::format("{} holds a negative variance", view.name));
  return std::make_shared<RealNvp>(std::move(flow), std::move(parameters));
}

}  // namespace warpath
