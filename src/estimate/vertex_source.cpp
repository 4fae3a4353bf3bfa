#include "estimate/vertex_source.h"

#include <algorithm>
#include <cmath>

namespace warpath {
namespace {

// Roulette by what a path is expected to bring [VK16]: one that is to bring less than 1 / kWorthwhile of what its pixel
// shows ends with a probability that goes with it. The bound is theirs for a window of 5, and flat: 3 and 10 do the
// same at equal time.
constexpr float kWorthwhile = 4;
/// What is expected may be wrong.
constexpr float kLeastSurvival = 0.15f;

/// The number of roulette of a path that goes on with probability p, where the renderer lets one go on whose number is
/// less than `survival`. Piecewise linear in the latent z; 1 / q is the ratio of the two widths.
float draw_survival(double z, float p, float survival, float& inv_q) {
  if (z < p) {
    inv_q = survival / p;
    return std::min(static_cast<float>(z / p * survival), std::nextafter(survival, 0.0f));
  }
  inv_q = (1 - survival) / (1 - p);
  return std::clamp(static_cast<float>(survival + (z - p) / (1 - p) * (1 - survival)), survival,
                    std::nextafter(1.0f, 0.0f));
}

}  // namespace

void VertexSource::locate(std::uint16_t bounce, std::span<const std::uint32_t> lanes, const VertexContext& context) {
  auto& [z, y, places, place_of_lane, located, scattered, expected, unknown] = m_scratch;
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
      if (!is_known(lanes[i])) unknown.add(context.at(i));
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

void VertexSource::draw_jointly(VertexDecision which, Group first, std::span<const std::uint32_t> lanes,
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
  if (which == VertexDecision::scattering && !m_brightness.empty())
    for (std::size_t i = 0; i < n; ++i) m_scratch.scattered[lanes[i]] = inv_q[i];
}

bool VertexSource::draw_roulette(Group group, std::span<const std::uint32_t> lanes, const VertexContext& context,
                                 float* u, float* inv_q) {
  if (m_brightness.empty() || !m_warp.warps(VertexDecision::scattering, group.bounce)) return false;
  const std::size_t n = lanes.size();
  auto& [z, y, places, place_of_lane, located, scattered, expected, unknown] = m_scratch;
  z[0].resize(std::max(z[0].size(), n));
  expected.resize(std::max(expected.size(), n));
  locate(group.bounce, lanes, context);
  for (std::size_t i = 0; i < n; ++i) inv_q[i] = scattered[lanes[i]];
  if (!m_warp.expect_return(places.data(), n, inv_q, expected.data())) return false;
  latents().fill(group.first_dimension(), lanes, z[0].data());
  for (std::size_t i = 0; i < n; ++i) {
    const float contribution = context.throughput[i] * expected[i];
    const float share = kWorthwhile * contribution / m_brightness[lanes[i]];
    // NaN, where nothing is seen and nothing expected, goes on.
    const float p = share < 1 ? std::max(share, kLeastSurvival) : 1.0f;
    u[i] = draw_survival(z[0][i], p, context.survival[i], inv_q[i]);
  }
  return true;
}

bool VertexSource::draw(Group group, std::span<const std::uint32_t> lanes, const VertexContext* context, float* u0,
                        float* u1, float* inv_q) {
  const std::size_t n = lanes.size();
  const bool of_light = group.kind == GroupKind::light || group.kind == GroupKind::light_uv;
  const VertexDecision which = of_light ? VertexDecision::light_sampling : VertexDecision::scattering;
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
    case GroupKind::rr:
      if (draw_roulette(group, lanes, *context, u0, inv_q)) return true;
      break;
    default:
      break;
  }
  return UniformSource::draw(group, lanes, context, u0, u1, inv_q);
}

}  // namespace warpath
