#include "path/primary_source.h"

#include "core/rng.h"

namespace warpath {

bool UniformSource::draw(Group group, std::span<const std::uint32_t> lanes, const VertexContext*, float* u0, float* u1,
                         float*) {
  const std::uint32_t d = group.first_dimension();
  m_latents.fill(d, lanes, u0);
  if (u1) m_latents.fill(d + 1, lanes, u1);
  return false;
}

bool FixedSource::draw(Group group, std::span<const std::uint32_t> lanes, const VertexContext* context, float* u0,
                       float* u1, float* inv_q) {
  const int column = m_layout.column(group);
  if (column < 0) return UniformSource::draw(group, lanes, context, u0, u1, inv_q);
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    const double* row = m_y + lanes[i] * m_stride + column;
    u0[i] = to_primary(row[0]);
    if (u1) u1[i] = to_primary(row[1]);
  }
  return false;
}

}  // namespace warpath
