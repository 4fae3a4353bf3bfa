#pragma once
#include "path/vertex_recorder.h"
#include "tracer/compiled_scene.h"
#include "tracer/path_recorder.h"
#include "tracer/tracer.h"
#include "tracer/workspace.h"

namespace warpath {

/// One batch of paths, one bounce at a time. Lives for one batch; the workspace is the thread's.
class PathLoop {
 public:
  PathLoop(const CompiledScene& scene, PrimarySource& source, Workspace& workspace, std::size_t lanes);

  /// Draws film, lens and time, and finds what the camera sees. Must be called first; film positions go to film_x,
  /// film_y.
  void start(float* film_x, float* film_y);
  /// All that comes after: radiance[lane] without directly seen emission. recorder may be null.
  void trace(Color* radiance, PathRecorder* recorder);
  /// Directly seen emission.
  void emission(Color* radiance);
  void first_hits(FirstHits& hits);

 private:
  bool draw(Group group, std::span<const std::uint32_t> lanes, const VertexContext* context,
            const DrawnNumbers& numbers);
  void skip_emitters();
  bool may_continue(std::uint32_t bounce) const;
  void resolve_hits(std::uint32_t bounce, Color* radiance, PathRecorder* recorder);
  void group_by_material();
  void prefetch_hits(std::size_t k, const Workspace::Group& group) const;
  void resolve_point(std::size_t k, SurfacePoint& point);
  void resolve_plain(const Workspace::Group& group);
  void resolve_any(const Workspace::Group& group);
  void fill_context();
  void sample_emitters(std::uint16_t bounce, Color* radiance, PathRecorder* recorder);
  void trace_shadow_rays(std::size_t count, Color* radiance, PathRecorder* recorder);
  void sample_bsdfs(std::uint16_t bounce, PathRecorder* recorder);
  void play_roulette(std::uint16_t bounce, PathRecorder* recorder);

  const CompiledScene& m_scene;
  PrimarySource& m_source;
  Workspace& m_work;
  const std::size_t m_lanes;
  const int m_max_depth, m_rr_depth;
  const bool m_hide_emitters;
  bool m_needs_context = false;
  std::size_t m_rays = 0, m_vertices = 0;
};

}  // namespace warpath
