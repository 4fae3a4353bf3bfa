#pragma once
#include <memory>
#include <vector>

#include "path/vertex_recorder.h"
#include "tracer/workspace.h"

namespace warpath {

/// Keeps every vertex of a batch while it is traced, and when the batch is done works out what came back from beyond
/// each of them. All colours are "local": over the throughput of the path before the vertex, channel by channel.
class PathRecorder {
 public:
  /// Starts a batch of `lanes` paths.
  void begin(std::size_t lanes);
  /// The vertices of the next bounce: entry i belongs to path vertex_lanes[i]. Numbers that are not drawn stay 0.
  void begin_bounce(std::uint16_t bounce, std::span<const std::uint32_t> vertex_lanes, const ContextArrays& context);
  /// A number's value at vertex i: its place among light, light_uv x 2, lobe, dir x 2, rr.
  void number(std::size_t i, int place, float value) { bounce().numbers[place][i] = value; }
  void inv_q_light(std::size_t i, float factor) { bounce().inv_q_light[i] *= factor; }
  void inv_q_scatter(std::size_t i, float factor) { bounce().inv_q_scatter[i] *= factor; }
  void light(std::size_t i, const Color& local) { bounce().light[i] = local; }
  /// By what the path's throughput is multiplied at vertex i; 0 if it ends there.
  void step(std::size_t i, const Color& factor) { bounce().step[i] = factor; }
  void scale_step(std::size_t i, float factor) { bounce().step[i] *= factor; }
  /// Emission that the ray from the path's last recorded vertex met, with its MIS weight.
  void emission(std::uint32_t lane, const Color& local);
  /// Shows all bounces, first to last.
  void finish(VertexRecorder& recorder);

 private:
  struct Bounce {
    std::uint16_t bounce = 0;
    std::vector<std::uint32_t> lanes;
    VertexBuffer vertices;
    std::array<std::vector<float>, kBounceDimensions> numbers;
    std::vector<float> inv_q_light, inv_q_scatter;
    std::vector<Color> light, step, emission;
    std::vector<float> light_return, scatter_return;
  };
  Bounce& bounce() { return m_bounces[m_used - 1]; }

  std::vector<Bounce> m_bounces;  // kept between batches for their memory
  std::size_t m_used = 0;
  std::vector<std::uint32_t> m_entry;  // lane -> its entry in the last bounce that it took part in
  std::vector<Color> m_returned;       // lane -> what came back to the vertex that was looked at last
};

}  // namespace warpath
