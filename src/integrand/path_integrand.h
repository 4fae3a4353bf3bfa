#pragma once
#include <memory>

#include "path/integrand.h"
#include "path/layout.h"
#include "tracer/tracer.h"

namespace warpath {

/// The tracer as a black box on the unit hypercube: y holds the numbers that a layout names, f is the radiance of the
/// path (linear RGB, directly seen emission left out). Numbers that the layout does not name are uniform, keyed by the
/// sample's id.
class PathIntegrand final : public Integrand {
 public:
  PathIntegrand(std::shared_ptr<const Tracer> tracer, Layout layout, std::uint64_t seed);

  int dims() const override { return m_layout.dims(); }
  int channels() const override { return 3; }
  void evaluate(Batch<const double> y, std::span<const std::uint64_t> ids, Batch<double> f) const override;

  const Tracer& tracer() const { return *m_tracer; }
  const Layout& layout() const { return m_layout; }

 private:
  std::shared_ptr<const Tracer> m_tracer;
  Layout m_layout;
  std::uint64_t m_seed;
};

}  // namespace warpath
