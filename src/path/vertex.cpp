#include "path/vertex.h"

namespace warpath {

VertexContext VertexContext::from(std::size_t count) const {
  VertexContext rest = *this;
  const auto advance = [count](auto& values, const auto&) {
    if (values) values += count;
  };
  for_each_field(rest, *this, advance);
  advance(rest.throughput, throughput);
  advance(rest.survival, survival);
  return rest;
}

Vertex VertexContext::at(std::size_t i) const {
  Vertex vertex;
  for_each_field(vertex, *this, [i](auto& value, const auto* values) { value = values[i]; });
  return vertex;
}

void VertexBuffer::clear() {
  for_each_field(m_arrays, m_arrays, [](auto& values, const auto&) { values.clear(); });
}

void VertexBuffer::add(const Vertex& vertex) {
  for_each_field(m_arrays, vertex, [](auto& values, const auto& value) { values.push_back(value); });
}

void VertexBuffer::assign(const VertexContext& context, std::size_t n) {
  for_each_field(m_arrays, context, [n](auto& values, const auto* source) { values.assign(source, source + n); });
}

VertexContext VertexBuffer::view() const {
  VertexContext context;
  for_each_field(context, m_arrays, [](auto& pointer, const auto& values) { pointer = values.data(); });
  return context;
}

}  // namespace warpath
