#include "warp/proposal.h"

#include "warp/scratch.h"

namespace warpath {

void Warp::sample(Batch<const double> z, std::span<const double>, Batch<double> y, std::span<double> log_q) const {
  forward(z, y, log_q);
  for (double& log_det : log_q.first(z.rows())) log_det = -log_det;
}

void Warp::log_density(Batch<const double> y, std::span<double> log_q) const {
  const Scratch<double> z(y.rows() * y.cols());
  inverse(y, {z.data(), y.rows(), y.cols()}, log_q);
}

}  // namespace warpath
