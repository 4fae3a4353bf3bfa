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
  b.vertices.assign(context.view(), n);
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
    b.light_return.resize(b.lanes.size());
    b.scatter_return.resize(b.lanes.size());
    for (std::size_t i = 0; i < b.lanes.size(); ++i) {
      Color& returned = m_returned[b.lanes[i]];
      const Color scattered = b.step[i] * (b.emission[i] + returned);
      b.light_return[i] = luminance(b.light[i]);
      b.scatter_return[i] = luminance(scattered);
      returned = b.light[i] + scattered;
    }
  }
  for (std::size_t k = 0; k < m_used; ++k) {
    const Bounce& b = m_bounces[k];
    VertexRecords records;
    records.bounce = b.bounce;
    records.lanes = b.lanes;
    records.context = b.vertices.view();
    for (std::size_t d = 0; d < kBounceDimensions; ++d) records.numbers[d] = b.numbers[d].data();
    records.inv_q_light = b.inv_q_light.data();
    records.inv_q_scatter = b.inv_q_scatter.data();
    records.light_return = b.light_return.data();
    records.scatter_return = b.scatter_return.data();
    recorder.record(records);
  }
}

}  // namespace warpath
