#pragma once
#include <cmath>
#include <functional>

#include "path/integrand.h"
#include "train/candidates.h"

namespace warpath {

/// A function of y alone as a black box; for tests.
class TestIntegrand : public Integrand {
 public:
  using Function = std::function<void(std::span<const double> y, std::span<double> f)>;
  TestIntegrand(int dims, int channels, Function f) : m_dims(dims), m_channels(channels), m_f(std::move(f)) {}
  int dims() const override { return m_dims; }
  int channels() const override { return m_channels; }
  void evaluate(Batch<const double> y, std::span<const std::uint64_t>, Batch<double> f) const override {
    for (std::size_t i = 0; i < y.rows(); ++i) m_f(y.row(i), f.row(i));
  }

 private:
  int m_dims, m_channels;
  Function m_f;
};

/// A Gaussian bump in the middle, 0.15 wide in each dimension.
inline TestIntegrand bump(int dims) {
  return {dims, 1, [](auto y, auto f) {
            double square = 0;
            for (const double x : y) square += (x - 0.5) * (x - 0.5);
            f[0] = std::exp(-square / (2 * 0.15 * 0.15));
          }};
}

/// A layout of D dimensions, up to 32.
inline Layout layout_of(int dims) {
  std::string names = dims % 2 ? "time" : "film";
  for (int k = 1, d = dims % 2 ? 1 : 2; d < dims; ++k, d += 2) names += "+bounce" + std::to_string(k);
  return Layout::parse(names);
}

}  // namespace warpath
