#include "estimate/image_estimator.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/rng.h"
#include "core/stopwatch.h"
#include "core/streams.h"
#include "estimate/film_positions.h"
#include "estimate/vertex_source.h"
#include "estimate/warped_source.h"
#include "warpath/error.h"

namespace warpath {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Lanes of one wavefront: enough to fill SIMD kernels and to sort rays, few enough to stay in L2. A tenth of uniform
/// samples, and the rest, fill whole blocks of 64 in the kernels of a warp.
constexpr std::size_t kBatch = 2560;
/// Side of the square of pixels that is rendered together, so that camera rays of a batch are coherent.
constexpr int kTile = 8;
/// Camera rays for directly seen emission, per path of a pixel that may see it: its edges would else be all that one
/// sees of a noisy film. Where such pixels are few, as many as make a quarter of all paths: they cost next to nothing,
/// and edges would be the roughest part of an image that converges.
constexpr int kEmissionRays = 4, kMostEmissionRays = 32;
constexpr std::size_t kPathsPerEmissionRay = 4;

/// Everything that a batch needs, kept from batch to batch.
struct Job {
  std::vector<std::uint64_t> ids;
  std::vector<std::uint32_t> pixels, indices, replicates;
  Latents latents, warp_latents;
  Matrix<double> y;
  std::vector<double> z, u, log_q;
  std::vector<float> inv_q, film_x, film_y, weight, brightness;
  VertexSourceScratch vertices;
  std::unique_ptr<VertexRecorder> recorder;
  PathResults results;
  double warp_seconds = 0, trace_seconds = 0;
};

/// Pixels of the crop window, tile by tile.
std::vector<std::uint32_t> tiled_pixels(int width, int height) {
  std::vector<std::uint32_t> pixels;
  pixels.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y0 = 0; y0 < height; y0 += kTile)
    for (int x0 = 0; x0 < width; x0 += kTile)
      for (int y = y0; y < std::min(height, y0 + kTile); ++y)
        for (int x = x0; x < std::min(width, x0 + kTile); ++x)
          pixels.push_back(static_cast<std::uint32_t>(y * width + x));
  return pixels;
}

/// Pixels within `radius` of one that is marked.
std::vector<std::uint8_t> dilate(const std::vector<std::uint8_t>& mask, int width, int height, int radius) {
  std::vector<std::uint8_t> wide(mask.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!mask[static_cast<std::size_t>(y * width + x)]) continue;
      for (int j = std::max(0, y - radius); j <= std::min(height - 1, y + radius); ++j)
        for (int i = std::max(0, x - radius); i <= std::min(width - 1, x + radius); ++i)
          wide[static_cast<std::size_t>(j * width + i)] = 1;
    }
  return wide;
}

/// weight and replicates: one per lane, or empty if all are 1 and 0.
void add_to_film(Film& film, const FilmSettings& settings, const PathResults& results, std::size_t lanes,
                 std::span<const float> weight = {}, std::span<const std::uint32_t> replicates = {}) {
  const auto crop_x = static_cast<float>(settings.crop_x), crop_y = static_cast<float>(settings.crop_y);
  for (std::size_t i = 0; i < lanes; ++i)
    film.add(results.film_x[i] - crop_x, results.film_y[i] - crop_y, results.radiance[i],
             weight.empty() ? 1.0f : weight[i], replicates.empty() ? 0 : replicates[i]);
}

/// Shows the film how samples `begin` ... `begin + cells` differ, which lie one in each cell of a grid with rows of
/// `row` cells. Two samples of one cell would tell its variance, half their squared difference. Neighbours lie further
/// apart: across a straight edge, where the noise of directly seen emission is, those of a row and a column together
/// differ twice as often. (Edge along an axis: the offset of two samples of a cell is 1/3 of a cell on average, and so
/// it is for neighbours along the edge; for those across it is 1.) Hence a quarter of each squared difference; smooth
/// changes are overestimated by 2.
void add_grid_errors(Film& film, const FilmSettings& settings, const PathResults& results, std::size_t begin,
                     std::size_t row, std::size_t cells) {
  const std::size_t rows = cells / row, pairs = (row - 1) * rows + row * (rows - 1);
  const double share = 0.25 * static_cast<double>(cells) / static_cast<double>(pairs);
  const auto crop_x = static_cast<float>(settings.crop_x), crop_y = static_cast<float>(settings.crop_y);
  const auto sample = [&](std::size_t i) {
    return Film::Sample{results.film_x[i] - crop_x, results.film_y[i] - crop_y, results.radiance[i]};
  };
  const auto compare = [&](std::size_t a, std::size_t b) {
    // Where both see the same, only the filter's slope is between them, which is nothing beside an edge.
    if (!(results.radiance[a] == results.radiance[b])) film.add_neighbours(sample(a), sample(b), share);
  };
  for (std::size_t i = 0; i < cells; ++i) {
    if (i % row + 1 < row) compare(begin + i, begin + i + 1);
    if (i + row < cells) compare(begin + i, begin + i + row);
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
      m_film(tracer.scene().film, m_joint ? Film::Weights::expected : Film::Weights::sampled,
             sampler == Sampler::independent ? Film::Errors::moments : Film::Errors::replicates) {
  WARPATH_CHECK(!m_joint || m_sampler == Sampler::independent);
  if (m_proposal) WARPATH_CHECK_EQ(m_proposal->dims(), m_layout.dims());
  const FilmSettings& film = tracer.scene().film;
  m_pixels = tiled_pixels(film.crop_width, film.crop_height);
  m_begun.resize(m_pixels.size());
  const int reach = static_cast<int>(std::ceil(film.filter.radius + 0.5f));
  const auto may_see = dilate(tracer.may_see_emission(), film.crop_width, film.crop_height, reach);
  for (const std::uint32_t pixel : m_pixels)
    if (may_see[pixel]) m_emission_pixels.push_back(pixel);
  if (!m_emission_pixels.empty()) m_emission.emplace(film, Film::Weights::sampled, Film::Errors::neighbours);
}

void ImageEstimator::add_pass(int spp, const Progress& progress, const std::function<bool()>& stop) {
  add_emission_pass(spp, stop);
  add_paths(spp, nullptr, progress, stop);
}

void ImageEstimator::add_guided_pass(int spp, const Guidance& guidance, const Progress& progress,
                                     const std::function<bool()>& stop) {
  WARPATH_CHECK(!m_joint && !(m_proposal && guidance.warp));
  add_emission_pass(spp, stop);
  if (!m_moments) m_moments.emplace(m_film.width(), m_film.height());
  m_pass_moments.emplace(m_film.width(), m_film.height());
  add_paths(spp, &guidance, progress, stop);
  *m_moments += *m_pass_moments;
}

void ImageEstimator::add_paths(int spp, const Guidance* guide, const Progress& progress,
                               const std::function<bool()>& stop) {
  const Guidance guidance = guide ? *guide : Guidance{};
  const FilmSettings& film = m_tracer.scene().film;
  const std::size_t pixels = m_pixels.size();
  const auto dims = static_cast<std::size_t>(m_layout.dims());
  const auto first = static_cast<std::uint64_t>(m_passes_spp);
  const std::uint64_t latent_seed = mix64(m_seed ^ kLatentStream);

  // Stratified film: all samples of a pixel stand together, and pixels in the order of m_pixels: begin[k] is the first
  // sample of the k-th.
  std::vector<std::uint32_t> counts;
  std::vector<std::uint64_t> begin;
  if (!m_joint) {
    counts.assign(pixels, static_cast<std::uint32_t>(spp));
    if (guidance.objective && m_passes_spp > 0)
      counts = m_moments->allocate(spp, *guidance.objective,
                                   sample_double(sample_key(m_seed ^ kAllocationStream, first), 0));
    begin.assign(1, 0);
    for (const std::uint32_t pixel : m_pixels) begin.push_back(begin.back() + counts[pixel]);
  }
  std::vector<float> brightness;  // of each pixel
  if (guidance.warp && m_passes_spp > 0) brightness = m_moments->brightness();
  const std::size_t total = m_joint ? pixels * static_cast<std::size_t>(spp) : begin.back();
  const std::size_t batches = (total + kBatch - 1) / kBatch;
  m_passes_spp += spp;

  const auto number_samples = [&](Job& job, std::size_t batch) {
    job.ids.clear();
    job.pixels.clear();
    job.weight.clear();
    job.indices.clear();
    job.replicates.clear();
    const std::size_t from = batch * kBatch, to = std::min(total, from + kBatch);
    if (m_joint) {
      for (std::size_t i = from; i < to; ++i) job.ids.push_back(first * pixels + i);
      return;
    }
    auto k = static_cast<std::size_t>(std::upper_bound(begin.begin(), begin.end(), from) - begin.begin()) - 1;
    for (std::size_t i = from; i < to; ++i) {
      while (i >= begin[k + 1]) ++k;
      const std::uint32_t pixel = m_pixels[k];
      const std::uint64_t in_pass = i - begin[k], in_pixel = m_begun[pixel] + in_pass;
      job.pixels.push_back(pixel);
      if (m_sampler == Sampler::independent) {
        job.ids.push_back(in_pixel * pixels + pixel);
      } else {
        // A stream for each pixel, replicate, and pass that begins anew.
        const std::uint64_t replicate = in_pixel % kReplicates, sequence = guide ? first + 1 : 0;
        job.ids.push_back((sequence * kReplicates + replicate) * pixels + pixel);
        job.indices.push_back(static_cast<std::uint32_t>((guide ? in_pass : in_pixel) / kReplicates));
        job.replicates.push_back(static_cast<std::uint32_t>(replicate));
      }
      if (guide) job.weight.push_back(guidance.weight * static_cast<float>(spp) / static_cast<float>(counts[pixel]));
    }
  };
  const auto place_on_film = [&](Job& job) {
    const std::uint32_t d = Group{GroupKind::film}.first_dimension();
    const auto width = static_cast<std::uint32_t>(film.crop_width);
    job.latents.fill(d, job.film_x.data());
    job.latents.fill(d + 1, job.film_y.data());
    for (std::size_t i = 0; i < job.pixels.size(); ++i) {
      job.film_x[i] = film_position(job.pixels[i] % width, job.film_x[i], film.crop_width);
      job.film_y[i] = film_position(job.pixels[i] / width, job.film_y[i], film.crop_height);
    }
  };
  const auto draw_primary_samples = [&](Job& job) {
    const std::size_t n = job.ids.size();
    job.warp_latents.assign(m_sampler, latent_seed, job.ids, job.indices);
    for (std::size_t c = 0; c < dims; ++c) {
      job.warp_latents.fill(m_layout.dimension(static_cast<int>(c)), job.z.data());
      for (std::size_t i = 0; i < n; ++i) job.y(i, c) = job.z[i];
    }
    job.warp_latents.fill(kComponentDimension, job.u.data());
    // Over a warped film every sample stands for the whole image, so components may be stratified over the batch: the
    // share of each is the same in every batch. A pixel of a stratified film needs all of them.
    if (m_joint)
      for (std::size_t i = 0; i < n; ++i) job.u[i] = (static_cast<double>(i) + job.u[i]) / static_cast<double>(n);
    const auto y = job.y.batch().rows_from(0, n);
    m_proposal->sample(y, std::span(job.u).first(n), y, std::span(job.log_q).first(n));
    for (std::size_t i = 0; i < n; ++i) job.inv_q[i] = static_cast<float>(std::exp(-job.log_q[i]));
  };

  double warp_seconds = 0, trace_seconds = 0;
  const Stopwatch clock;
  const auto work = [&](Job& job, std::size_t batch) {
    const auto begin = Clock::now();
    number_samples(job, batch);
    const std::size_t n = job.ids.size();
    job.film_x.resize(m_joint ? 0 : n);
    job.film_y.resize(m_joint ? 0 : n);
    if (m_proposal) {
      if (job.y.rows() < n) job.y = Matrix<double>(std::max(n, kBatch), dims);
      job.z.resize(std::max(n, kBatch));
      job.u.resize(std::max(n, kBatch));
      job.log_q.resize(std::max(n, kBatch));
      job.inv_q.resize(n);
      draw_primary_samples(job);
    }
    job.warp_seconds = m_proposal ? seconds_since(begin) : 0;
    job.latents.assign(m_sampler, m_seed, job.ids, job.indices);
    if (!m_joint) place_on_film(job);
    if (guidance.learner && !job.recorder) job.recorder = guidance.learner->make_recorder();
    if (guidance.warp) {
      job.brightness.clear();
      if (!brightness.empty())
        for (const std::uint32_t pixel : job.pixels) job.brightness.push_back(brightness[pixel]);
      VertexSource source(job.latents, *guidance.warp, job.film_x, job.film_y, job.brightness, job.vertices);
      m_tracer.trace(source, n, job.results, job.recorder.get());
    } else {
      static const Layout uniform;
      WarpedSource source(job.latents, m_proposal ? m_layout : uniform, job.y.batch(),
                          m_proposal ? std::span<const float>(job.inv_q) : std::span<const float>(), job.film_x,
                          job.film_y);
      m_tracer.trace(source, n, job.results, job.recorder.get());
    }
    job.trace_seconds = seconds_since(begin) - job.warp_seconds;
  };
  const auto merge = [&](Job& job, std::size_t batch) {
    const auto begin = Clock::now();
    add_to_film(m_film, film, job.results, job.ids.size(), job.weight, job.replicates);
    if (m_pass_moments)
      for (std::size_t i = 0; i < job.pixels.size(); ++i) m_pass_moments->add(job.pixels[i], job.results.radiance[i]);
    if (job.recorder) guidance.learner->merge(*job.recorder);
    m_cost.samples += job.ids.size();
    warp_seconds += job.warp_seconds;
    trace_seconds += job.trace_seconds + seconds_since(begin);
    if (progress) progress(static_cast<double>(batch + 1) / static_cast<double>(batches));
  };
  run_ordered<Job>(batches, work, merge, [&] { return stop && stop(); });
  for (std::size_t p = 0; p < counts.size(); ++p) m_begun[p] += counts[p];

  const double warp_share = warp_seconds / std::max(1e-12, warp_seconds + trace_seconds);
  const double wall = clock.wall(), cpu = clock.cpu();
  m_cost.warp_seconds += wall * warp_share;
  m_cost.trace_seconds += wall * (1 - warp_share);
  m_cost.warp_cpu_seconds += cpu * warp_share;
  m_cost.trace_cpu_seconds += cpu * (1 - warp_share);
}

void ImageEstimator::add_emission_pass(int spp, const std::function<bool()>& stop) {
  if (!m_emission) return;
  const std::size_t affordable = m_pixels.size() / (kPathsPerEmissionRay * m_emission_pixels.size());
  const int rays = spp * std::clamp(static_cast<int>(affordable), kEmissionRays, kMostEmissionRays);
  const FilmSettings& film = m_tracer.scene().film;
  const Stopwatch clock;
  // A jittered grid inside each pixel, of at least `rays` cells.
  const int nx = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(rays)))), ny = (rays + nx - 1) / nx;
  const auto cells = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
  // A batch takes whole pixels, or whole rows of a pixel's grid if that is too large.
  const std::size_t row = static_cast<std::size_t>(nx);
  const std::size_t lanes = cells <= kBatch ? kBatch / cells * cells : std::max<std::size_t>(1, kBatch / row) * row;
  const std::size_t per_pixel = (cells + lanes - 1) / lanes;  // batches; 1 for whole pixels
  const std::size_t total = m_emission_pixels.size() * cells;
  const std::size_t batches = per_pixel > 1 ? m_emission_pixels.size() * per_pixel : (total + lanes - 1) / lanes;
  // The first ray of a batch.
  const auto first_ray = [&](std::size_t batch) {
    if (per_pixel == 1) return std::min(total, batch * lanes);
    return batch / per_pixel * cells + batch % per_pixel * lanes;
  };
  const std::uint64_t seed = mix64(m_seed ^ kEmissionStream);
  const std::uint64_t first_id = m_emission_rays;
  m_emission_rays += total;

  const auto work = [&](Job& job, std::size_t batch) {
    const std::size_t begin = first_ray(batch), n = first_ray(batch + 1) - begin;
    job.ids.resize(n);
    job.film_x.resize(n);
    job.film_y.resize(n);
    const std::uint32_t d = Group{GroupKind::film}.first_dimension();
    const auto width = static_cast<std::uint32_t>(film.crop_width);
    for (std::size_t i = 0; i < n; ++i) {
      job.ids[i] = first_id + begin + i;
      const std::uint32_t pixel = m_emission_pixels[(begin + i) / cells];
      const auto cell = static_cast<int>((begin + i) % cells);
      const std::uint64_t key = sample_key(seed, job.ids[i]);
      const float x = (static_cast<float>(cell % nx) + sample_float(key, d)) / static_cast<float>(nx);
      const float y = (static_cast<float>(cell / nx) + sample_float(key, d + 1)) / static_cast<float>(ny);
      job.film_x[i] = film_position(pixel % width, x, film.crop_width);
      job.film_y[i] = film_position(pixel / width, y, film.crop_height);
    }
    static const Layout uniform;
    job.latents.assign(seed, job.ids);
    WarpedSource source(job.latents, uniform, {}, {}, job.film_x, job.film_y);
    m_tracer.trace_emission(source, n, job.results);
  };
  const auto merge = [&](Job& job, std::size_t) {
    add_to_film(*m_emission, film, job.results, job.ids.size());
    const std::size_t grid = std::min(cells, job.ids.size());
    for (std::size_t i = 0; i < job.ids.size(); i += grid)
      add_grid_errors(*m_emission, film, job.results, i, row, grid);
    m_cost.emission_rays += job.ids.size();
  };
  run_ordered<Job>(batches, work, merge, [&] { return stop && stop(); });
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

ImageEstimate ImageEstimator::develop_emission() const {
  if (m_emission) return m_emission->develop();
  const std::vector<Color> black(m_pixels.size(), Color(0.0f));
  const FilmSettings& film = m_tracer.scene().film;
  return {film.crop_width, film.crop_height, black, black, std::vector<float>(m_pixels.size())};
}

ImageEstimate ImageEstimator::develop() const {
  ImageEstimate image = develop_rest();
  if (m_emission) m_emission->develop_onto(image);
  return image;
}

ImageEstimate ImageEstimator::take() {
  ImageEstimate image = m_film.take();
  add_uniform_samples(image);
  if (m_emission) m_emission->develop_onto(image);
  return image;
}

double ImageEstimator::spp() const {
  const std::uint64_t samples = m_cost.samples + (m_uniform ? m_uniform->samples() : 0);
  return static_cast<double>(samples) / static_cast<double>(m_pixels.size());
}

std::uint64_t ImageEstimator::non_finite() const {
  return m_film.non_finite() + (m_emission ? m_emission->non_finite() : 0) + (m_uniform ? m_uniform->non_finite() : 0);
}

}  // namespace warpath
