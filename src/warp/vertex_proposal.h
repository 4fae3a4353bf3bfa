#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "path/layout.h"
#include "path/primary_source.h"

namespace warpath {

class TensorFile;

/// Numbers that are drawn as one at a vertex: three that choose the light and the point on it, or three that choose
/// the lobe and the direction in it.
enum class VertexDecision : std::uint8_t { light_sampling, scattering };

/// A density over the numbers of one vertex, given what the path knows there: a warp that lives at every vertex.
/// Immutable and thread-safe.
class VertexProposal {
 public:
  virtual ~VertexProposal() = default;
  virtual std::string family() const = 0;
  /// The numbers that it draws, see check_decisions; empty for those of every vertex.
  virtual const Layout& numbers() const = 0;
  /// Whether these numbers of the bounce-th vertex are its own; else they are uniform.
  virtual bool warps(VertexDecision, std::uint16_t /*bounce*/) const { return true; }
  /// How many 32-bit words what is found out about a vertex takes.
  virtual std::size_t place_size() const { return 1; }
  /// What the warp finds out about n vertices once, for all the numbers that are drawn there: place_size() words each.
  virtual void locate(const VertexContext& context, std::size_t n, std::uint32_t* places) const = 0;
  /// Draws the numbers of n vertices, located before. z: three arrays of n uniform latents in [0,1); y: three arrays of
  /// n numbers in [0,1); inv_q: n, 1 / q of the y that were handed out, given the context.
  virtual void sample(VertexDecision which, const VertexContext& context, const std::uint32_t* places, std::size_t n,
                      const std::array<const double*, 3>& z, const std::array<float*, 3>& y, float* inv_q) const = 0;
  /// inv_q[i] = 1 / q(y[i] | context[i]).
  virtual void inverse_density(VertexDecision which, const VertexContext& context, const std::uint32_t* places,
                               std::size_t n, const std::array<const float*, 3>& y, float* inv_q) const = 0;
  /// What comes back on average through the direction that was scattered into at n vertices, as luminance over the
  /// throughput at the vertex; infinite where nothing is known. inv_q: of the numbers that were drawn. A guess, which
  /// only roulette goes by. Returns false if the warp cannot tell anywhere.
  virtual bool expect_return(const std::uint32_t* /*places*/, std::size_t /*n*/, const float* /*inv_q*/,
                             float* /*expected*/) const {
    return false;
  }
  /// Puts tensors and metadata under names that start with `prefix`.
  virtual void save(TensorFile& file, const std::string& prefix) const = 0;
};

}  // namespace warpath
