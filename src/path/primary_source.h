#pragma once
#include <cstdint>
#include <span>

#include "path/latents.h"
#include "path/layout.h"
#include "path/vertex.h"

namespace warpath {

/// The one door: every random number inside the tracer comes from here, a group at a time, for a whole batch of paths,
/// at the moment when it is needed. A source belongs to one batch on one thread.
class PrimarySource {
 public:
  virtual ~PrimarySource() = default;
  /// Numbers of `group` for the paths `lanes` (strictly ascending indices into the batch). context is null for film,
  /// lens and time. u0 and u1 (null for groups of one number) and inv_q get one entry per lane. Returns false if every
  /// inv_q is 1; then inv_q is not written. The tracer multiplies the inv_q of light groups into that one
  /// light-sampling term, and that of all others into all that follows. Roulette never sees inv_q, so that f stays a
  /// function of y.
  virtual bool draw(Group group, std::span<const std::uint32_t> lanes, const VertexContext* context, float* u0,
                    float* u1, float* inv_q) = 0;
  /// Whether draws at vertices shall come with a context; without, they get null, which is cheaper.
  virtual bool wants_context() const { return false; }
};

/// Uniform numbers, as latents give them.
class UniformSource : public PrimarySource {
 public:
  /// Independent numbers: seed and ids name the samples; lane i is sample ids[i].
  UniformSource(std::uint64_t seed, std::span<const std::uint64_t> ids) : m_own(seed, ids), m_latents(m_own) {}
  /// A view: not copied.
  explicit UniformSource(const Latents& latents) : m_latents(latents) {}
  UniformSource(const UniformSource&) = delete;
  UniformSource& operator=(const UniformSource&) = delete;
  bool draw(Group group, std::span<const std::uint32_t> lanes, const VertexContext* context, float* u0, float* u1,
            float* inv_q) override;

 protected:
  const Latents& latents() const { return m_latents; }

 private:
  Latents m_own;  // empty if they are another's
  const Latents& m_latents;
};

/// Hands out a given y for the groups of a layout, and uniform numbers for all others: inv_q is 1 throughout. With it
/// the tracer is the integrand f(y).
class FixedSource final : public UniformSource {
 public:
  /// y: one row per lane, columns as in `layout`, row-major with `stride` doubles between rows. Views: not copied.
  FixedSource(std::uint64_t seed, std::span<const std::uint64_t> ids, const Layout& layout, const double* y,
              std::size_t stride)
      : UniformSource(seed, ids), m_layout(layout), m_y(y), m_stride(stride) {}
  FixedSource(const Latents& latents, const Layout& layout, const double* y, std::size_t stride)
      : UniformSource(latents), m_layout(layout), m_y(y), m_stride(stride) {}
  bool draw(Group group, std::span<const std::uint32_t> lanes, const VertexContext* context, float* u0, float* u1,
            float* inv_q) override;

 private:
  const Layout& m_layout;
  const double* m_y;
  std::size_t m_stride;
};

}  // namespace warpath
