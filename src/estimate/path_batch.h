#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "estimate/sample_numbering.h"
#include "estimate/vertex_source.h"
#include "path/latents.h"
#include "path/layout.h"
#include "path/vertex_recorder.h"
#include "tracer/tracer.h"
#include "warp/proposal.h"
#include "warp/vertex_proposal.h"
#include "warpath/batch.h"

namespace warpath {

/// What the batches of a pass share: which samples there are, and what draws their numbers.
struct PathPass {
  const Tracer& tracer;
  const SampleNumbering& numbering;
  std::uint64_t seed;
  Sampler sampler;
  const Proposal* proposal = nullptr;  ///< draws the dimensions of `layout`; null: they are uniform
  const Layout* layout = nullptr;
  const VertexProposal* warp = nullptr;     ///< draws the numbers of vertices, without a proposal; null: uniform
  std::span<const float> brightness{};      ///< luminance that each pixel is thought to have; empty: not known yet
  const VertexObserver* learner = nullptr;  ///< is to be shown all vertices; null: none
  std::size_t batches() const;
};

/// A batch of paths: numbered, drawn and traced. Its memory is used again for the next one, of the same pass.
class PathBatch {
 public:
  void make(const PathPass& pass, std::size_t index);

  const NumberedSamples& samples() const { return m_samples; }
  const PathResults& results() const { return m_results; }
  /// What the vertices of the batch left for the learner; null without one.
  VertexRecorder* recorder() const { return m_recorder.get(); }
  double warp_seconds() const { return m_warp_seconds; }    ///< drawing from the proposal
  double trace_seconds() const { return m_trace_seconds; }  ///< the rest

 private:
  void draw(const PathPass& pass);
  void place_on_film(const FilmSettings& film);
  void trace(const PathPass& pass);

  NumberedSamples m_samples;
  Latents m_latents, m_warp_latents;
  // One entry for each lane.
  std::vector<float> m_film_x, m_film_y;  // stratified film: positions
  Matrix<double> m_y;                     // what the proposal drew
  std::vector<double> m_z, m_u, m_log_q;
  std::vector<float> m_inv_q;
  std::vector<float> m_brightness;
  VertexSourceScratch m_vertices;
  std::unique_ptr<VertexRecorder> m_recorder;
  PathResults m_results;
  double m_warp_seconds = 0, m_trace_seconds = 0;
};

}  // namespace warpath
