#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "core/ordered.h"
#include "estimate/allocation.h"
#include "estimate/emission_estimator.h"
#include "estimate/film.h"
#include "estimate/path_batch.h"
#include "estimate/sample_numbering.h"
#include "path/latents.h"
#include "path/layout.h"
#include "path/vertex_recorder.h"
#include "tracer/tracer.h"
#include "warp/proposal.h"
#include "warp/vertex_proposal.h"

namespace warpath {

/// Where a render's time went. Thread time is shared out over the wall time of the passes.
struct RenderCost {
  std::uint64_t samples = 0;        ///< paths
  std::uint64_t emission_rays = 0;  ///< camera rays for directly seen emission
  double warp_seconds = 0;          ///< drawing numbers with their density
  double trace_seconds = 0;         ///< tracing and splatting
  double emission_seconds = 0;
  double warp_cpu_seconds = 0;   ///< of all threads, as the one below
  double trace_cpu_seconds = 0;  ///< tracing, splatting, directly seen emission
  double total() const { return warp_seconds + trace_seconds + emission_seconds; }
  double cpu_total() const { return warp_cpu_seconds + trace_cpu_seconds; }
};

/// What a pass over a stratified film is told by the passes before it.
struct Guidance {
  const VertexProposal* warp = nullptr;  ///< draws the numbers of vertices; null: they are uniform
  VertexObserver* learner = nullptr;     ///< is shown all vertices
  std::optional<Objective> objective{};  ///< samples go where it says; else every pixel has as many
  float weight = 1;                      ///< of a sample of this pass: must not depend on the values of this pass
};

/// Renders one image with one proposal, pass after pass.  [ZZ19, the warped estimator: C(y) W_j / q(y)]
///
/// If the layout holds `film`, samples fall where the proposal puts them, and every pixel's divisor is what uniform
/// positions would have brought (unbiased); else every pixel has its own samples, and weights are divided out as they
/// fell (consistent, as Mitsuba does it). Directly seen emission is estimated apart, by camera rays of its own.
class ImageEstimator {
 public:
  /// The tracer must outlive the estimator. proposal: null draws all numbers uniformly; else proposal->dims() ==
  /// layout.dims(). The same seed gives the same bits for any number of threads, if the passes are the same.
  /// Every sampler but `independent` is for stratified films: a pixel's samples go in turn to kReplicates sequences of
  /// their own, whose spread tells the variance. Plain passes carry the sequences on; each guided pass begins anew,
  /// since points that fit those of earlier passes would depend on what these taught.
  ImageEstimator(const Tracer& tracer, Layout layout, std::shared_ptr<const Proposal> proposal, std::uint64_t seed,
                 Sampler sampler = Sampler::independent);

  /// Adds `spp` samples per pixel (spp x pixels samples where the film is warped), and at least 4 x spp camera rays to
  /// each pixel that may see an emitter. stop() is asked between batches; a pass that was stopped counts with what it
  /// has.
  void add_pass(int spp, const Progress& progress = {}, const std::function<bool()>& stop = {});

  /// The same with guidance, for a stratified film; with a warp of vertices the proposal must be null. Every pass
  /// weighs by its samples per pixel, the same in every pixel, so samples may be placed by what earlier ones found.
  void add_guided_pass(int spp, const Guidance& guidance, const Progress& progress = {},
                       const std::function<bool()>& stop = {});

  /// Adds at least 4 x `spp` camera rays to each pixel that may see an emitter, and no path; where these are few, as
  /// many as a quarter of the paths.
  void add_emission_pass(int spp, const std::function<bool()>& stop = {});

  /// A path that was traced elsewhere from uniform numbers, film position (in [0,1)^2) included, such as a candidate of
  /// the warp's training. Those paths make an image of their own, which counts with its share of all samples.
  void add_uniform_sample(float film_x, float film_y, const Color& radiance);

  ImageEstimate develop() const;           ///< the whole image
  ImageEstimate take();                    ///< the whole image, for the last time: see Film::take
  ImageEstimate develop_rest() const;      ///< without directly seen emission
  ImageEstimate develop_emission() const;  ///< directly seen emission alone
  double spp() const;                      ///< samples per pixel so far
  std::uint64_t non_finite() const;
  /// Of the last guided pass, and of all of them. There must have been one.
  const PixelMoments& pass_moments() const { return *m_pass_moments; }
  const PixelMoments& moments() const { return *m_moments; }
  const RenderCost& cost() const { return m_cost; }
  Sampler sampler() const { return m_sampler; }

 private:
  /// A pass of these samples with what the estimator itself brings: nothing that guides.
  PathPass unguided(const SampleNumbering& numbering) const;
  /// Traces a pass, and merges its batches into the film and with `also`, in their order.
  void add_paths(const PathPass& pass, const std::function<void(const PathBatch&)>& also, const Progress& progress,
                 const std::function<bool()>& stop);
  void add_uniform_samples(ImageEstimate& image) const;

  const Tracer& m_tracer;
  Layout m_layout;
  std::shared_ptr<const Proposal> m_proposal;
  std::uint64_t m_seed;
  Sampler m_sampler;
  bool m_joint;                         // the film is among the warped dimensions
  std::vector<std::uint32_t> m_pixels;  // in the order in which they are rendered
  BegunSamples m_begun;
  Film m_film;
  EmissionEstimator m_emission;
  std::optional<Film> m_uniform;
  std::optional<PixelMoments> m_moments, m_pass_moments;  // of all guided passes, and of the last
  RenderCost m_cost;
};

}  // namespace warpath
