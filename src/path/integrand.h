#pragma once
#include <cstdint>
#include <span>

#include "warpath/batch.h"

namespace warpath {

/// A black box on the unit hypercube: random numbers in, contribution out.
class Integrand {
 public:
  virtual ~Integrand() = default;
  virtual int dims() const = 0;      ///< D, the numbers that a warp may choose
  virtual int channels() const = 0;  ///< C, 3 for images (linear RGB)
  /// f(y) for whole batches. y: N x D in [0,1); ids: N, the sample's number, which keys every random number outside
  /// the D chosen ones; f: N x C. Thread-safe. Values may be NaN or infinite; whoever sums them counts those.
  virtual void evaluate(Batch<const double> y, std::span<const std::uint64_t> ids, Batch<double> f) const = 0;
};

}  // namespace warpath
