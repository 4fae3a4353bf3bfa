#include "tracer/tracer.h"

#include "tracer/emission_mask.h"
#include "tracer/path_loop.h"

namespace warpath {
namespace {

// Used again by every batch of a thread, so that nothing is allocated per batch.
Workspace& thread_workspace() {
  thread_local Workspace workspace;
  return workspace;
}
PathRecorder& thread_recorder() {
  thread_local PathRecorder recorder;
  return recorder;
}

}  // namespace

void PathResults::resize(std::size_t lanes) {
  film_x.resize(lanes);
  film_y.resize(lanes);
  radiance.resize(lanes);
}

void FirstHits::resize(std::size_t lanes) {
  film_x.resize(lanes);
  film_y.resize(lanes);
  albedo.resize(lanes);
  normal.resize(lanes);
  distance.resize(lanes);
}

struct Tracer::Impl {
  explicit Impl(Scene&& source) : compiled(std::move(source)), emission_mask(find_emission_mask(compiled)) {}
  const CompiledScene compiled;
  const std::vector<std::uint8_t> emission_mask;
};

Tracer::Tracer(Scene scene) : m_impl(std::make_unique<const Impl>(std::move(scene))) {}
Tracer::~Tracer() = default;

const Scene& Tracer::scene() const { return m_impl->compiled.scene; }
int Tracer::emitters() const { return static_cast<int>(m_impl->compiled.emitters.size()); }
const std::vector<std::uint8_t>& Tracer::may_see_emission() const { return m_impl->emission_mask; }

void Tracer::trace(PrimarySource& source, std::size_t lanes, PathResults& results, VertexRecorder* recorder) const {
  results.resize(lanes);
  PathLoop loop(m_impl->compiled, source, thread_workspace(), lanes);
  loop.start(results.film_x.data(), results.film_y.data());
  if (!recorder) return loop.trace(results.radiance.data(), nullptr);
  PathRecorder& paths = thread_recorder();
  paths.begin(lanes);
  loop.trace(results.radiance.data(), &paths);
  paths.finish(*recorder);
}

void Tracer::trace_emission(PrimarySource& source, std::size_t lanes, PathResults& results) const {
  results.resize(lanes);
  PathLoop loop(m_impl->compiled, source, thread_workspace(), lanes);
  loop.start(results.film_x.data(), results.film_y.data());
  loop.emission(results.radiance.data());
}

void Tracer::trace_first_hits(PrimarySource& source, std::size_t lanes, FirstHits& hits) const {
  hits.resize(lanes);
  PathLoop loop(m_impl->compiled, source, thread_workspace(), lanes);
  loop.start(hits.film_x.data(), hits.film_y.data());
  loop.first_hits(hits);
}

}  // namespace warpath
