#include "tracer/path_recorder.h"

namespace warpath {

void PathRecorder::begin(std::size_t lanes) {
  m_used = 0;
  m_entry.assign(lanes, 0);
}

void PathRecorder::begin_bounce(std::uint16_t number, std::span<const std::uint32_t> vertex_lanes,
                                const ContextArrays& context) {
  if (m_used == m_bounces.size()) m_bounces.emplace_back();
  Bounce& b = m_bounces[m_used++];
  const std::size_t n = vertex_lanes.size();
  b.bounce = number;
  b.lanes.assign(vertex_lanes.begin(), vertex_lanes.end());
  const VertexContext view = context.view();
  for (std::size_t k = 0; k < 3; ++k) {
    b.context[k].assign(view.position[k], view.position[k] + n);
    b.context[3 + k].assign(view.normal[k], view.normal[k] + n);
    b.context[6 + k].assign(view.wi[k], view.wi[k] + n);
    b.context[9 + k].assign(view.albedo[k], view.albedo[k] + n);
  }
  b.context[12].assign(view.roughness, view.roughness + n);
  for (std::size_t k = 0; k < 2; ++k) b.context[13 + k].assign(view.film[k], view.film[k] + n);
  b.kind.assign(view.kind, view.kind + n);
  b.material.assign(view.material, view.material + n);
  for (auto& values : b.numbers) values.assign(n, 0.0f);
  b.inv_q_light.assign(n, 1.0f);
  b.inv_q_scatter.assign(n, 1.0f);
  b.light.assign(n, Color(0.0f));
  b.step.assign(n, Color(0.0f));
  b.emission.assign(n, Color(0.0f));
  for (std::size_t i = 0; i < n; ++i) m_entry[vertex_lanes[i]] = static_cast<std::uint32_t>(i);
}

void PathRecorder::emission(std::uint32_t lane, const Color& local) { bounce().emission[m_entry[lane]] = local; }

void PathRecorder::finish(VertexRecorder& recorder) {
  m_returned.assign(m_entry.size(), Color(0.0f));
  for (std::size_t k = m_used; k-- > 0;) {
    Bounce& b = m_bounces[k];
    b.light_luminance.resize(b.lanes.size());
    b.beyond_luminance.resize(b.lanes.size());
    for (std::size_t i = 0; i < b.lanes.size(); ++i) {
      Color& returned = m_returned[b.lanes[i]];
      const Color beyond = b.step[i] * (b.emission[i] + returned);
      b.light_luminance[i] = luminance(b.light[i]);
      b.beyond_luminance[i] = luminance(beyond);
      returned = b.light[i] + beyond;
    }
  }
  for (std::size_t k = 0; k < m_used; ++k) {
    const Bounce& b = m_bounces[k];
    const auto vec3 = [&](std::size_t first) {
      return std::array<const float*, 3>{b.context[first].data(), b.context[first + 1].data(),
                                         b.context[first + 2].data()};
    };
    VertexRecords records;
    records.bounce = b.bounce;
    records.lanes = b.lanes;
    records.context = {vec3(0),
                       vec3(3),
                       vec3(6),
                       vec3(9),
                       b.context[12].data(),
                       b.kind.data(),
                       b.material.data(),
                       {b.context[13].data(), b.context[14].data()}};
    for (std::size_t d = 0; d < kBounceDimensions; ++d) records.numbers[d] = b.numbers[d].data();
    records.inv_q_light = b.inv_q_light.data();
    records.inv_q_scatter = b.inv_q_scatter.data();
    records.light = b.light_luminance.data();
    records.beyond = b.beyond_luminance.data();
    recorder.record(records);
  }
}

}  // namespace warpath
