#pragma once
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "warpath/batch.h"

namespace warpath {

class TensorFile;

/// A density on [0,1)^D that can be sampled. Immutable and thread-safe; one virtual call per batch, not per sample.
class Proposal {
 public:
  virtual ~Proposal() = default;
  virtual int dims() const = 0;
  virtual std::string family() const = 0;  ///< `uniform`, `grid`, `kdtree`, `realnvp`, `mixture`, ...
  /// Draws one y per row. z: N x D uniform latents in [0,1); u: N uniform numbers in [0,1) that pick a mixture's
  /// component; y: N x D in [0,1); log_q: N, ln q(y) of the y that was handed out. z and y may be the same memory.
  virtual void sample(Batch<const double> z, std::span<const double> u, Batch<double> y,
                      std::span<double> log_q) const = 0;
  /// log_q[i] = ln q(y[i]); -infinity where q is 0.
  virtual void log_density(Batch<const double> y, std::span<double> log_q) const = 0;
  /// Puts tensors and metadata under names that start with `prefix`; load_proposal reads them back.
  virtual void save(TensorFile& file, const std::string& prefix) const = 0;
};

/// A proposal that is also a bijection on [0,1)^D.
class Warp : public Proposal {
 public:
  /// y = Psi(z); log_det[i] = ln|det dPsi/dz|, so q(y) = exp(-log_det).  [ZZ19, change of variables]
  virtual void forward(Batch<const double> z, Batch<double> y, std::span<double> log_det) const = 0;
  /// z = Psi^-1(y); log_det is that of Psi^-1, so q(y) = exp(log_det). forward(inverse(y)) is y within 1e-5.
  virtual void inverse(Batch<const double> y, Batch<double> z, std::span<double> log_det) const = 0;

  void sample(Batch<const double> z, std::span<const double> u, Batch<double> y,
              std::span<double> log_q) const override;
  void log_density(Batch<const double> y, std::span<double> log_q) const override;
};

}  // namespace warpath
