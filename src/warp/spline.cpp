#include "warp/spline.h"

#include "core/tensor_file.h"
#include "warp/flow_file.h"
#include "warp/load.h"
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
  save_settings(file, prefix, settings());
  save_parameters(file, prefix, m_flow, m_parameters);
}

std::shared_ptr<const Spline> Spline::load(const TensorFile& file, const std::string& prefix) {
  const int dims = load_dims(file, prefix);
  spline::Flow flow(dims, load_spline_settings(file, prefix));
  auto parameters = load_parameters(file, prefix, flow);
  return std::make_shared<Spline>(std::move(flow), std::move(parameters));
}

}  // namespace warpath
