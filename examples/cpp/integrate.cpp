// Two narrow peaks in eight dimensions: adapt, then measure with a warp that no longer changes.
#include <warpath/integrator.h>
#include <cmath>
#include <cstdio>

int main() {
  const auto two_peaks = [](warpath::Batch<const double> x, warpath::Batch<double> f) {
    for (std::size_t i = 0; i < x.rows(); ++i) {
      double low = 0, high = 0;
      for (const double v : x.row(i)) {
        low += (v - 0.3) * (v - 0.3);
        high += (v - 0.7) * (v - 0.7);
      }
      f(i, 0) = std::exp(-100 * low) + std::exp(-100 * high);
    }
  };
  warpath::Integrator integrator(std::vector<warpath::Interval>(8));
  integrator.integrate(two_peaks, {.nitn = 6, .neval = 50'000});
  const warpath::Integral result = integrator.integrate(two_peaks, {.nitn = 4, .neval = 50'000, .adapt = false});
  std::printf("%s%s, exactly %.6g\n", result.summary().c_str(),
              warpath::with_error(result.mean(), result.sdev()).c_str(), 2 * std::pow(std::sqrt(M_PI / 100), 8));
}
