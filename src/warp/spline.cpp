#include "warp/spline.h"

#include "core/tensor_file.h"
#include "warp/flow_file.h"
#include "warp/load.h"
#include "warp/spline_kernels.h"
#include "warpath/error.h"

namespace warpath {

Spline::Spline(spline::Flow flow, nn::AlignedVector<float> parameters)
    : m_flow(std::move(flow)), m_parameters(std::move(parameters)) {
  WARPATH_CHECK_EQ(m_parameters.size(), m_flow.parameter_count());
  m_flow.pack(m_parameters.data(), m_packed, false);
}

std::shared_ptr<const Spline> Spline::untrained(int dims, const SplineSettings& settings, std::uint64_t seed) {
  spline::Flow flow(dims, settings);
  auto parameters = flow.initial(seed);
  return std::make_shared<Spline>(std::move(flow), std::move(parameters));
}

void Spline::forward(Batch<const double> z, Batch<double> y, std::span<double> log_det) const {
  run_flow(m_flow, m_packed, true, z, y, log_det);
}

void Spline::inverse(Batch<const double> y, Batch<double> z, std::span<double> log_det) const {
  run_flow(m_flow, m_packed, false, y, z, log_det);
}

void Spline::save(TensorFile& file, const std::string& prefix) const {
  save_header(file, prefix, *this);
  auto& meta = file.metadata();
  const SplineSettings& s = settings();
  meta[prefix + "couplings"] = std::to_string(s.couplings);
  meta[prefix + "width"] = std::to_string(s.width);
  meta[prefix + "blocks"] = std::to_string(s.blocks);
  meta[prefix + "bins"] = std::to_string(s.bins);
  meta[prefix + "encoding_bins"] = std::to_string(s.encoding_bins);
  meta[prefix + "masks"] = s.masks == SplineSettings::Masks::binary ? "binary" : "autoregressive";
  save_parameters(file, prefix, m_flow, m_parameters);
}

std::shared_ptr<const Spline> Spline::load(const TensorFile& file, const std::string& prefix) {
  const int dims = load_dims(file, prefix);
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
  spline::Flow flow(dims, s);
  auto parameters = load_parameters(file, prefix, flow);
  return std::make_shared<Spline>(std::move(flow), std::move(parameters));
}

}  // namespace warpath
