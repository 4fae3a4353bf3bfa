#include "estimate/emission_estimator.h"

#include <algorithm>
#include <cmath>

#include "core/ordered.h"
#include "core/rng.h"
#include "core/streams.h"
#include "estimate/batch_lanes.h"
#include "estimate/film_positions.h"
#include "estimate/jittered_grid.h"
#include "estimate/warped_source.h"

namespace warpath {
namespace {

/// Rays per path of a pixel that may see an emitter: its edges would else be all that one sees of a noisy film. Where
/// such pixels are few, as many as make a quarter of all paths: they cost next to nothing, and edges would be the
/// roughest part of an image that converges.
constexpr int kRaysPerPath = 4, kMostRaysPerPath = 32;
constexpr std::size_t kPathsPerRay = 4;

/// Everything that a batch needs, kept from batch to batch.
struct RayBatch {
  std::vector<std::uint64_t> ids;
  std::vector<float> film_x, film_y;
  Latents latents;
  PathResults results;
};

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
  const auto compare = [&](std::size_t a, std::size_t b) {
    // Where both see the same, only the filter's slope is between them, which is nothing beside an edge.
    if (!(results.radiance[a] == results.radiance[b]))
      film.add_neighbours(film_sample(settings, results, a), film_sample(settings, results, b), share);
  };
  for (std::size_t i = 0; i < cells; ++i) {
    if (i % row + 1 < row) compare(begin + i, begin + i + 1);
    if (i + row < cells) compare(begin + i, begin + i + row);
  }
}

}  // namespace

EmissionEstimator::EmissionEstimator(const Tracer& tracer, std::span<const std::uint32_t> pixels, std::uint64_t seed)
    : m_tracer(tracer), m_seed(mix64(seed ^ kEmissionStream)), m_image_size(pixels.size()) {
  const FilmSettings& film = tracer.scene().film;
  const int reach = static_cast<int>(std::ceil(film.filter.radius + 0.5f));
  const auto may_see = dilate(tracer.may_see_emission(), film.crop_width, film.crop_height, reach);
  for (const std::uint32_t pixel : pixels)
    if (may_see[pixel]) m_pixels.push_back(pixel);
  if (!m_pixels.empty()) m_film.emplace(film, Film::Weights::sampled, Film::Errors::neighbours);
}

std::uint64_t EmissionEstimator::add_pass(int spp, const std::function<bool()>& stop) {
  if (!sees_any()) return 0;
  const std::size_t affordable = m_image_size / (kPathsPerRay * m_pixels.size());
  const int rays_per_pixel = spp * std::clamp(static_cast<int>(affordable), kRaysPerPath, kMostRaysPerPath);
  const JitteredGrid grid(rays_per_pixel, m_pixels.size(), kBatchLanes);
  const FilmSettings& film = m_tracer.scene().film;
  const std::uint64_t first_id = m_begun;
  m_begun += grid.rays();
  std::uint64_t added = 0;

  const auto work = [&](RayBatch& batch, std::size_t index) {
    const std::size_t begin = grid.first_ray(index), n = grid.first_ray(index + 1) - begin;
    batch.ids.resize(n);
    batch.film_x.resize(n);
    batch.film_y.resize(n);
    const std::uint32_t d = Group{GroupKind::film}.first_dimension();
    for (std::size_t i = 0; i < n; ++i) {
      batch.ids[i] = first_id + begin + i;
      const std::uint64_t key = sample_key(m_seed, batch.ids[i]);
      const Vec2 place = grid.place(begin + i, {sample_float(key, d), sample_float(key, d + 1)});
      batch.film_x[i] = place.x;
      batch.film_y[i] = place.y;
      place_in_pixel(film, m_pixels[(begin + i) / grid.cells()], batch.film_x[i], batch.film_y[i]);
    }
    batch.latents.assign(m_seed, batch.ids);
    WarpedSource source(batch.latents, batch.film_x, batch.film_y);
    m_tracer.trace_emission(source, n, batch.results);
  };
  const auto merge = [&](RayBatch& batch, std::size_t) {
    const std::size_t n = batch.ids.size(), cells = std::min(grid.cells(), n);
    for (std::size_t i = 0; i < n; ++i) {
      const Film::Sample sample = film_sample(film, batch.results, i);
      m_film->add(sample.x, sample.y, sample.value);
    }
    for (std::size_t i = 0; i < n; i += cells) add_grid_errors(*m_film, film, batch.results, i, grid.columns(), cells);
    added += n;
  };
  run_ordered<RayBatch>(grid.batches(), work, merge, [&] { return stop && stop(); });
  return added;
}

ImageEstimate EmissionEstimator::develop() const {
  if (m_film) return m_film->develop();
  const std::vector<Color> black(m_image_size, Color(0.0f));
  const FilmSettings& film = m_tracer.scene().film;
  return {film.crop_width, film.crop_height, black, black, std::vector<float>(m_image_size)};
}

void EmissionEstimator::develop_onto(ImageEstimate& image) const {
  if (m_film) m_film->develop_onto(image);
}

}  // namespace warpath
