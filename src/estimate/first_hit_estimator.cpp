#include "estimate/first_hit_estimator.h"

#include <algorithm>

#include "core/ordered.h"
#include "core/rng.h"
#include "estimate/film_positions.h"
#include "estimate/warped_source.h"

namespace warpath {

FirstHitImages estimate_first_hits(const Tracer& tracer, int rays, std::uint64_t seed) {
  const FilmSettings& film = tracer.scene().film;
  const auto width = static_cast<std::size_t>(film.crop_width), height = static_cast<std::size_t>(film.crop_height);
  FirstHitImages images;
  images.albedo.resize(width * height, Color(0.0f));
  images.normal.resize(width * height, Color(0.0f));
  images.depth.resize(width * height, 0.0f);

  struct Job {
    std::vector<std::uint64_t> ids;
    std::vector<float> film_x, film_y;
    FirstHits hits;
  };
  // One row of the image at a time.
  const std::size_t lanes = width * static_cast<std::size_t>(rays);
  const auto work = [&](Job& job, std::size_t row) {
    job.ids.resize(lanes);
    job.film_x.resize(lanes);
    job.film_y.resize(lanes);
    for (std::size_t i = 0; i < lanes; ++i) {
      job.ids[i] = row * lanes + i;
      const std::uint64_t key = sample_key(seed, job.ids[i]);
      const auto x = static_cast<std::uint32_t>(i / static_cast<std::size_t>(rays));
      job.film_x[i] = film_position(x, sample_float(key, 0), film.crop_width);
      job.film_y[i] = film_position(static_cast<std::uint32_t>(row), sample_float(key, 1), film.crop_height);
    }
    const Latents latents(seed, job.ids);
    WarpedSource source(latents, job.film_x, job.film_y);
    tracer.trace_first_hits(source, lanes, job.hits);
  };
  const auto merge = [&](Job& job, std::size_t row) {
    const float scale = 1.0f / static_cast<float>(rays);
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t pixel = row * width + x;
      int hit = 0;
      for (std::size_t i = x * static_cast<std::size_t>(rays); i < (x + 1) * static_cast<std::size_t>(rays); ++i) {
        const Vec3& n = job.hits.normal[i];
        images.albedo[pixel] += job.hits.albedo[i] * scale;
        images.normal[pixel] += Color(n.x, n.y, n.z) * scale;
        images.depth[pixel] += job.hits.distance[i];
        hit += job.hits.distance[i] > 0 ? 1 : 0;
      }
      images.depth[pixel] /= static_cast<float>(std::max(1, hit));
    }
  };
  run_ordered<Job>(height, work, merge, [] { return false; });
  return images;
}

}  // namespace warpath
