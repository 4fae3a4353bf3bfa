#include "integrand/test_functions.h"

#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "warpath/error.h"

namespace warpath {
namespace {

constexpr double kSigma = 0.2;

class Pointwise final : public TestFunction {
 public:
  using Function = std::function<double(std::span<const double>)>;
  Pointwise(int dims, double exact, Function function)
      : m_dims(dims), m_exact(exact), m_function(std::move(function)) {}
  int dims() const override { return m_dims; }
  double exact() const override { return m_exact; }
  void evaluate(Batch<const double> y, std::span<const std::uint64_t> ids, Batch<double> f) const override {
    WARPATH_CHECK_EQ(static_cast<int>(y.cols()), m_dims);
    WARPATH_CHECK_EQ(f.rows(), y.rows());
    WARPATH_CHECK_EQ(ids.size(), y.rows());
    for (std::size_t i = 0; i < y.rows(); ++i) f(i, 0) = m_function(y.row(i));
  }

 private:
  int m_dims;
  double m_exact;
  Function m_function;
};

double peak(std::span<const double> y, double center) {
  double sum = 0;
  for (const double x : y) sum += (x - center) * (x - center);
  return std::pow(kSigma * std::sqrt(std::numbers::pi), -static_cast<double>(y.size())) *
         std::exp(-sum / (kSigma * kSigma));
}

double ring(double radial, double x, double y, double center_x, double center_y) {
  const double distance2 = (x - center_x) * (x - center_x) + (y - center_y) * (y - center_y);
  return radial * radial * radial * std::exp(-250 * std::abs(distance2 - 0.0625));
}

}  // namespace

std::unique_ptr<TestFunction> make_test_function(std::string_view name, int dims) {
  static constexpr std::array<std::string_view, 4> kNames{"gauss", "camel", "circles", "polynomial"};
  if (dims < 1) throw ConfigError(fmt::format("a test function of {} dimensions; it needs at least 1", dims));
  if (name == "gauss")
    return std::make_unique<Pointwise>(dims, std::pow(std::erf(0.5 / kSigma), dims),
                                       [](std::span<const double> y) { return peak(y, 0.5); });
  if (name == "camel") {
    const double one = 0.5 * (std::erf(2 / (3 * kSigma)) + std::erf(1 / (3 * kSigma)));
    return std::make_unique<Pointwise>(dims, std::pow(one, dims), [](std::span<const double> y) {
      return 0.5 * (peak(y, 1 / 3.0) + peak(y, 2 / 3.0));
    });
  }
  if (name == "circles") {
    if (dims != 2) throw ConfigError(fmt::format("circles has 2 dimensions, not {}", dims));
    return std::make_unique<Pointwise>(2, 0.01368477, [](std::span<const double> y) {
      return ring(y[1], y[0], y[1], 0.4, 0.6) + ring(1 - y[1], y[0], y[1], 0.6, 0.4);
    });
  }
  if (name == "polynomial")
    return std::make_unique<Pointwise>(dims, dims / 6.0, [](std::span<const double> y) {
      double sum = 0;
      for (const double x : y) sum += x - x * x;
      return sum;
    });
  throw ConfigError(fmt::format("unknown test function \"{}\"{}", name, suggestion(name, kNames)));
}

}  // namespace warpath
