#include "warp/uniform.h"

#include <algorithm>

#include "warp/load.h"
#include "warpath/error.h"

namespace warpath {

Uniform::Uniform(int dims) : m_dims(dims) { WARPATH_CHECK(dims >= 1 && dims <= kMaxDims); }

void Uniform::forward(Batch<const double> z, Batch<double> y, std::span<double> log_det) const {
  for (std::size_t i = 0; i < z.rows(); ++i) std::copy_n(&z(i, 0), z.cols(), &y(i, 0));
  std::fill_n(log_det.begin(), z.rows(), 0.0);
}

void Uniform::inverse(Batch<const double> y, Batch<double> z, std::span<double> log_det) const {
  forward(y, z, log_det);
}

void Uniform::log_density(Batch<const double> y, std::span<double> log_q) const {
  std::fill_n(log_q.begin(), y.rows(), 0.0);
}

void Uniform::save(TensorFile& file, const std::string& prefix) const { save_header(file, prefix, *this); }

std::shared_ptr<const Uniform> Uniform::load(const TensorFile& file, const std::string& prefix) {
  return std::make_shared<Uniform>(load_dims(file, prefix));
}

}  // namespace warpath
