#include "tracer/workspace.h"

#include "warpath/error.h"

namespace warpath {

void Arena::reset(std::size_t n) {
  m_stride = (n + kPad - 1) / kPad * kPad + kPad;
  m_used = 0;
  if (kArrays * m_stride <= m_capacity) return;
  m_capacity = kArrays * m_stride;
  m_memory = std::make_unique<float[]>(m_capacity);
}

void* Arena::next() {
  WARPATH_CHECK(m_used < kArrays);
  return m_memory.get() + m_stride * m_used++;
}

VertexContext ContextArrays::view() const {
  VertexContext context;
  for_each_field(context, *this, [](auto& to, auto* from) { to = from; });
  context.throughput = throughput;
  return context;
}

void ContextArrays::copy(std::size_t to, const ContextArrays& source, std::size_t from) const {
  for_each_field(*this, source, [&](auto* values, const auto* others) { values[to] = others[from]; });
  throughput[to] = source.throughput[from];
}

void Workspace::resize(std::size_t n) {
  m_arena.reset(n);
  const auto floats = [&] { return m_arena.take<float>(); };
  const auto indices = [&] { return m_arena.take<std::uint32_t>(); };
  const auto bytes = [&] { return m_arena.take<std::uint8_t>(); };
  const auto vectors = [&] { return Vec3Array{floats(), floats(), floats()}; };
  const auto ray_stream = [&] {
    return RayStream{floats(), floats(), floats(), floats(), floats(), floats(), floats(), floats()};
  };
  const auto hit_stream = [&] {
    return HitStream{floats(), floats(), floats(), floats(), floats(), floats(), indices(), indices()};
  };
  const auto numbers = [&] { return DrawnNumbers{floats(), floats(), floats()}; };
  const auto contexts = [&] {
    ContextArrays arrays;
    const auto take = [&]<class T>(T*& values, const auto&) { values = m_arena.take<T>(); };
    for_each_field(arrays, arrays, take);
    arrays.throughput = floats();
    return arrays;
  };
  beta = vectors();
  weight = floats();
  eta = floats();
  previous = vectors();
  previous_pdf = floats();
  straight = bytes();
  lanes = indices();
  rays = ray_stream();
  hits = hit_stream();
  vertex_lanes = indices(), vertex_hit = indices(), slot = indices(), rank = indices();
  smooth = bytes();
  order = indices();
  position = vectors();
  ng = vectors();
  time = floats();
  if (scatter.size() < n) scatter.resize(n);
  plain = {vectors(), vectors(), vectors()};
  uv[0] = floats(), uv[1] = floats();
  ordered_choice = floats(), ordered = numbers();
  samples = {vectors(), floats(), floats(), vectors()};
  value = vectors(), pdf = floats(), step_eta = floats(), straight_on = bytes();
  context = contexts();
  film = numbers(), lens = numbers(), shutter = numbers();
  light = numbers(), light_uv = numbers(), lobe = numbers(), dir = numbers(), roulette = numbers();
  survival = floats();
  subset = indices();
  subset_lanes = indices();
  subset_context = contexts();
  shadow_rays = ray_stream();
  shadow_vertex = indices();
  shadow_light = vectors();
  shadowed = bytes();
  passing = indices();
  passing_rays = ray_stream();
  passing_hits = hit_stream();
}

}  // namespace warpath
