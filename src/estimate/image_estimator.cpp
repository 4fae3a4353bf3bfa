#include "estimate/image_estimator.h"

#include <algorithm>

#include "core/rng.h"
#include "core/stopwatch.h"
#include "core/streams.h"
#include "estimate/film_positions.h"
#include "warpath/error.h"

namespace warpath {
namespace {

void add_to_film(Film& film, const FilmSettings& settings, const PathBatch& batch) {
  const NumberedSamples& samples = batch.samples();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Film::Sample sample = film_sample(settings, batch.results(), i);
    film.add(sample.x, sample.y, sample.value, samples.weights.empty() ? 1.0f : samples.weights[i],
             samples.replicates.empty() ? 0 : samples.replicates[i]);
  }
}

}  // namespace

ImageEstimator::ImageEstimator(const Tracer& tracer, Layout layout, std::shared_ptr<const Proposal> proposal,
                               std::uint64_t seed, Sampler sampler)
    : m_tracer(tracer),
      m_layout(std::move(layout)),
      m_proposal(std::move(proposal)),
      m_seed(seed),
      m_sampler(sampler),
      m_joint(m_layout.contains({GroupKind::film})),
      m_pixels(tiled_pixels(tracer.scene().film.crop_width, tracer.scene().film.crop_height)),
      m_film(tracer.scene().film, m_joint ? Film::Weights::expected : Film::Weights::sampled,
             sampler == Sampler::independent ? Film::Errors::moments : Film::Errors::replicates),
      m_emission(tracer, m_pixels, seed) {
  WARPATH_CHECK(!m_joint || m_sampler == Sampler::independent);
  if (m_proposal) WARPATH_CHECK_EQ(m_proposal->dims(), m_layout.dims());
  if (!m_joint) m_begun.in_pixel.resize(m_pixels.size());
}

PathPass ImageEstimator::unguided(const SampleNumbering& numbering) const {
  return {m_tracer, numbering, m_seed, m_sampler, m_proposal.get(), &m_layout};
}

void ImageEstimator::add_pass(int spp, const Progress& progress, const std::function<bool()>& stop) {
  add_emission_pass(spp, stop);
  const auto add = [&](const SampleNumbering& numbering) { add_paths(unguided(numbering), {}, progress, stop); };
  if (m_joint)
    add(JointNumbering(m_pixels.size(), m_begun, spp));
  else
    add(PlainNumbering(m_pixels, m_begun, m_sampler, spp));
  m_begun.add(spp);
}

void ImageEstimator::add_guided_pass(int spp, const Guidance& guidance, const Progress& progress,
                                     const std::function<bool()>& stop) {
  WARPATH_CHECK(!m_joint && !(m_proposal && guidance.warp));
  add_emission_pass(spp, stop);
  if (!m_moments) m_moments.emplace(m_film.width(), m_film.height());
  m_pass_moments.emplace(m_film.width(), m_film.height());

  // A first pass knows nothing of the pixels.
  std::vector<std::uint32_t> counts(m_pixels.size(), static_cast<std::uint32_t>(spp));
  std::vector<float> brightness;
  if (guidance.objective && m_begun.spp > 0)
    counts = m_moments->allocate(spp, *guidance.objective,
                                 sample_double(sample_key(m_seed ^ kAllocationStream, m_begun.spp), 0));
  if (guidance.warp && m_begun.spp > 0) brightness = m_moments->brightness();
  const GuidedNumbering numbering(m_pixels, m_begun, m_sampler, spp, counts, guidance.weight);
  PathPass pass = unguided(numbering);
  pass.warp = guidance.warp;
  pass.brightness = brightness;
  pass.learner = guidance.learner;
  const auto learn = [&](const PathBatch& batch) {
    for (std::size_t i = 0; i < batch.samples().size(); ++i)
      m_pass_moments->add(batch.samples().pixels[i], batch.results().radiance[i]);
    if (guidance.learner) guidance.learner->merge(*batch.recorder());
  };
  add_paths(pass, learn, progress, stop);
  m_begun.add(spp, counts);
  *m_moments += *m_pass_moments;
}

void ImageEstimator::add_paths(const PathPass& pass, const std::function<void(const PathBatch&)>& also,
                               const Progress& progress, const std::function<bool()>& stop) {
  double warp_seconds = 0, trace_seconds = 0;
  const Stopwatch clock;
  const std::size_t batches = pass.batches();
  const auto work = [&](PathBatch& batch, std::size_t index) { batch.make(pass, index); };
  const auto merge = [&](const PathBatch& batch, std::size_t index) {
    const Stopwatch merging;
    add_to_film(m_film, m_tracer.scene().film, batch);
    if (also) also(batch);
    m_cost.samples += batch.samples().size();
    warp_seconds += batch.warp_seconds();
    trace_seconds += batch.trace_seconds() + merging.wall();
    if (progress) progress(static_cast<double>(index + 1) / static_cast<double>(batches));
  };
  run_ordered<PathBatch>(batches, work, merge, [&] { return stop && stop(); });

  const double warp_share = warp_seconds / std::max(1e-12, warp_seconds + trace_seconds);
  const double wall = clock.wall(), cpu = clock.cpu();
  m_cost.warp_seconds += wall * warp_share;
  m_cost.trace_seconds += wall * (1 - warp_share);
  m_cost.warp_cpu_seconds += cpu * warp_share;
  m_cost.trace_cpu_seconds += cpu * (1 - warp_share);
}

void ImageEstimator::add_emission_pass(int spp, const std::function<bool()>& stop) {
  if (!m_emission.sees_any()) return;
  const Stopwatch clock;
  m_cost.emission_rays += m_emission.add_pass(spp, stop);
  m_cost.emission_seconds += clock.wall();
  m_cost.trace_cpu_seconds += clock.cpu();
}

void ImageEstimator::add_uniform_sample(float film_x, float film_y, const Color& radiance) {
  const FilmSettings& film = m_tracer.scene().film;
  if (!m_uniform) m_uniform.emplace(film, Film::Weights::expected);
  m_uniform->add(film_x * static_cast<float>(film.crop_width), film_y * static_cast<float>(film.crop_height), radiance);
}

void ImageEstimator::add_uniform_samples(ImageEstimate& image) const {
  if (!m_uniform) return;
  // One weight for the whole image, from counts alone: weights that looked at the values would bias it.
  const ImageEstimate uniform = m_uniform->develop();
  const auto n = static_cast<double>(m_film.samples() + m_uniform->samples());
  const auto share = static_cast<float>(static_cast<double>(m_uniform->samples()) / n);
  for (std::size_t p = 0; p < image.mean.size(); ++p) {
    image.mean[p] = image.mean[p] * (1 - share) + uniform.mean[p] * share;
    image.variance[p] = image.variance[p] * sqr(1 - share) + uniform.variance[p] * sqr(share);
    image.samples[p] += uniform.samples[p];
  }
}

ImageEstimate ImageEstimator::develop_rest() const {
  ImageEstimate image = m_film.develop();
  add_uniform_samples(image);
  return image;
}

ImageEstimate ImageEstimator::develop_emission() const { return m_emission.develop(); }

ImageEstimate ImageEstimator::develop() const {
  ImageEstimate image = develop_rest();
  m_emission.develop_onto(image);
  return image;
}

ImageEstimate ImageEstimator::take() {
  ImageEstimate image = m_film.take();
  add_uniform_samples(image);
  m_emission.develop_onto(image);
  return image;
}

double ImageEstimator::spp() const {
  const std::uint64_t samples = m_cost.samples + (m_uniform ? m_uniform->samples() : 0);
  return static_cast<double>(samples) / static_cast<double>(m_pixels.size());
}

std::uint64_t ImageEstimator::non_finite() const {
  return m_film.non_finite() + m_emission.non_finite() + (m_uniform ? m_uniform->non_finite() : 0);
}

}  // namespace warpath
