#pragma once
#include <cstdint>
#include <span>

#include "path/primary_source.h"
#include "warpath/batch.h"

namespace warpath {

/// From a warp to the numbers of a path: hands out the y that a proposal drew for the dimensions of a layout, film
/// positions where the film is stratified, and uniform numbers for all others. The whole 1 / q(y) comes with the film
/// numbers, which every path draws first, so it multiplies every term.
class WarpedSource final : public PrimarySource {
 public:
  /// latents: where uniform numbers come from. Views, one row or entry per lane; y has layout.dims() columns, inv_q may
  /// be empty (all 1). film: x and y in [0,1) of a stratified film; empty if the layout holds `film` or positions are
  /// uniform.
  WarpedSource(const Latents& latents, const Layout& layout, Batch<const double> y, std::span<const float> inv_q,
               std::span<const float> film_x, std::span<const float> film_y);
  /// Positions on a stratified film, and uniform numbers for all else.
  WarpedSource(const Latents& latents, std::span<const float> film_x, std::span<const float> film_y);
  bool draw(Group group, std::span<const std::uint32_t> lanes, const VertexContext* context, float* u0, float* u1,
            float* inv_q) override;

 private:
  FixedSource m_fixed;
  const Layout& m_layout;
  std::span<const float> m_inv_q, m_film_x, m_film_y;
};

}  // namespace warpath
