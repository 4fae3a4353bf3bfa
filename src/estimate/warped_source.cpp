#include "estimate/warped_source.h"

namespace warpath {
namespace {

const Layout kNothingWarped;

}  // namespace

WarpedSource::WarpedSource(const Latents& latents, const Layout& layout, Batch<const double> y,
                           std::span<const float> inv_q, std::span<const float> film_x, std::span<const float> film_y)
    : m_fixed(latents, layout, y.data(), y.stride()),
      m_layout(layout),
      m_inv_q(inv_q),
      m_film_x(film_x),
      m_film_y(film_y) {}

WarpedSource::WarpedSource(const Latents& latents, std::span<const float> film_x, std::span<const float> film_y)
    : WarpedSource(latents, kNothingWarped, {}, {}, film_x, film_y) {}

bool WarpedSource::draw(Group group, std::span<const std::uint32_t> lanes, const VertexContext* context, float* u0,
                        float* u1, float* inv_q) {
  if (group.kind != GroupKind::film) return m_fixed.draw(group, lanes, context, u0, u1, inv_q);
  if (m_film_x.empty()) {
    m_fixed.draw(group, lanes, context, u0, u1, inv_q);
  } else {
    for (std::size_t i = 0; i < lanes.size(); ++i) {
      u0[i] = m_film_x[lanes[i]];
      u1[i] = m_film_y[lanes[i]];
    }
  }
  if (m_inv_q.empty()) return false;
  for (std::size_t i = 0; i < lanes.size(); ++i) inv_q[i] = m_inv_q[lanes[i]];
  return true;
}

}  // namespace warpath
