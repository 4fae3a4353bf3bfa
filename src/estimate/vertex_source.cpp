#include "estimate/vertex_source.h"

#include <algorithm>

namespace warpath {

void VertexSource::locate(std::uint16_t bounce, std::span<const std::uint32_t> lanes, const VertexContext& context) {
  auto& [z, y, places, place_of_lane, located, unknown] = m_scratch;
  const std::size_t size = m_warp.place_size();
  places.resize(std::max(places.size(), lanes.size() * size));
  // Vertices that sample lights come first and are most of them; mirrors and glass may be left.
  const auto is_known = [&](std::uint32_t lane) { return located[lane] == bounce; };
  const auto keep = [&](std::size_t i) {
    std::copy_n(places.data() + i * size, size, place_of_lane.data() + lanes[i] * size);
  };
  if (std::any_of(lanes.begin(), lanes.end(), is_known)) {
    unknown.clear();
    for (std::size_t i = 0; i < lanes.size(); ++i)
      if (!is_known(lanes[i])) unknown.add(context, i);
    if (unknown.size() > 0) m_warp.locate(unknown.view(), unknown.size(), places.data());
    // What was found out moves to where it belongs, the last one first.
    for (std::size_t i = lanes.size(), k = unknown.size(); i-- > 0;) {
      if (is_known(lanes[i])) {
        std::copy_n(place_of_lane.data() + lanes[i] * size, size, places.data() + i * size);
      } else if (--k < i) {
        std::copy_n(places.data() + k * size, size, places.data() + i * size);
      }
    }
    for (std::size_t i = 0; i < lanes.size(); ++i)
      if (!is_known(lanes[i])) keep(i);
  } else {
    m_warp.locate(context, lanes.size(), places.data());
    for (std::size_t i = 0; i < lanes.size(); ++i) keep(i);
  }
  for (const std::uint32_t lane : lanes) located[lane] = bounce;
}

void VertexSource::draw_jointly(VertexNumbers which, Group first, std::span<const std::uint32_t> lanes,
                                const VertexContext& context, float* inv_q) {
  const std::size_t n = lanes.size();
  for (auto& z : m_scratch.z) z.resize(std::max(z.size(), n));
  for (auto& y : m_scratch.y) y.resize(std::max(y.size(), n));
  const std::uint32_t d = first.first_dimension();
  for (std::uint32_t a = 0; a < 3; ++a) latents().fill(d + a, lanes, m_scratch.z[a].data());
  const auto& z = m_scratch.z;
  locate(first.bounce, lanes, context);
  m_warp.sample(which, context, m_scratch.places.data(), n, {z[0].data(), z[1].data(), z[2].data()},
                {m_scratch.y[0].data(), m_scratch.y[1].data(), m_scratch.y[2].data()}, inv_q);
  m_drawn = first;
}

bool VertexSource::draw(Group group, std::span<const std::uint32_t> lanes, const VertexContext* context, float* u0,
                        float* u1, float* inv_q) {
  const std::size_t n = lanes.size();
  const bool of_light = group.kind == GroupKind::light || group.kind == GroupKind::light_uv;
  const VertexNumbers which = of_light ? VertexNumbers::light : VertexNumbers::scatter;
  switch (group.kind) {
    case GroupKind::film:
      for (std::size_t i = 0; i < n; ++i) {
        u0[i] = m_film_x[lanes[i]];
        u1[i] = m_film_y[lanes[i]];
      }
      return false;
    case GroupKind::light:
    case GroupKind::lobe:
      if (!m_warp.warps(which, group.bounce)) break;
      draw_jointly(which, group, lanes, *context, inv_q);
      std::copy_n(m_scratch.y[0].begin(), n, u0);
      return true;
    case GroupKind::light_uv:
    case GroupKind::dir: {
      if (!m_warp.warps(which, group.bounce)) break;
      const Group first{of_light ? GroupKind::light : GroupKind::lobe, group.bounce};
      const bool drawn = m_drawn == first;
      // A scene with one emitter has no choice to draw.
      if (!drawn) draw_jointly(which, first, lanes, *context, inv_q);
      std::copy_n(m_scratch.y[1].begin(), n, u0);
      std::copy_n(m_scratch.y[2].begin(), n, u1);
      return !drawn;
    }
    default:
      break;
  }
  return UniformSource::draw(group, lanes, context, u0, u1, inv_q);
}

}  // namespace warpath
