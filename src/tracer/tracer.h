#pragma once
#include <memory>
#include <span>
#include <vector>

#include "path/primary_source.h"
#include "path/vertex_recorder.h"
#include "scene/scene.h"

namespace warpath {

/// What a batch of paths gave: structure of arrays, one entry per lane.
struct PathResults {
  std::vector<float> film_x, film_y;  ///< in pixels of the whole film; the centre of the first pixel is (0.5, 0.5)
  std::vector<Color> radiance;        ///< without directly seen emission, times the inv_q of what each term used
  void resize(std::size_t lanes);
};

/// What the camera sees first, for AOVs and for warps that are conditioned on it.
struct FirstHits {
  std::vector<float> film_x, film_y;
  std::vector<Color> albedo;
  std::vector<Vec3> normal;     ///< shading normal, world space; zero where nothing is hit
  std::vector<float> distance;  ///< from the ray's origin; 0 where nothing is hit
  void resize(std::size_t lanes);
};

/// The wavefront path tracer: light and BSDF sampling combined by MIS, one bounce at a time for a whole batch.
/// Immutable; every function is thread-safe and takes all its random numbers from the source.
class Tracer {
 public:
  explicit Tracer(Scene scene);
  ~Tracer();
  const Scene& scene() const;
  int emitters() const;  ///< from how many the number `light` chooses

  /// Paths of `lanes` samples, without directly seen emission. Best with batches of 1,024 to 4,096.
  void trace(PrimarySource& source, std::size_t lanes, PathResults& results, VertexRecorder* recorder = nullptr) const;
  /// Directly seen emission alone; draws film, lens and time.
  void trace_emission(PrimarySource& source, std::size_t lanes, PathResults& results) const;
  void trace_first_hits(PrimarySource& source, std::size_t lanes, FirstHits& hits) const;
  /// For each pixel of the film's crop window (row-major): whether a camera ray through it may see an emitter directly.
  /// Conservative: a pixel marked 0 sees none for certain.
  const std::vector<std::uint8_t>& may_see_emission() const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> m_impl;
};

}  // namespace warpath
