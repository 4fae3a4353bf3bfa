#pragma once
#include <memory>
#include <string_view>

#include "path/integrand.h"

namespace warpath {

/// A scalar integrand in float64 whose integral over the unit hypercube is known.
class TestFunction : public Integrand {
 public:
  int channels() const override { return 1; }
  virtual double exact() const = 0;
};

/// By name: `gauss`, `camel`, `circles` (2 dimensions only), `polynomial`; any number of dimensions from 1.
/// Gauss: (s sqrt(pi))^-d exp(-sum (y - 1/2)^2 / s^2), s = 0.2, without 1/2 in the exponent; camel: the mean of two
/// such at 1/3 and 2/3; circles: two thin rings; polynomial: sum of y - y^2. [Deutschmann and Goetz 2023, CoVVVR, arXiv
/// 2309.12369; the documentation of vegas.] Throws ConfigError, which lists the known names.
std::unique_ptr<TestFunction> make_test_function(std::string_view name, int dims);

}  // namespace warpath
