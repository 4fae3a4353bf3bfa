#include "estimate/path_batch.h"

#include <algorithm>
#include <cmath>

#include "core/rng.h"
#include "core/stopwatch.h"
#include "core/streams.h"
#include "estimate/batch_lanes.h"
#include "estimate/film_positions.h"
#include "estimate/warped_source.h"

namespace warpath {

std::size_t PathPass::batches() const { return (numbering.size() + kBatchLanes - 1) / kBatchLanes; }

void PathBatch::make(const PathPass& pass, std::size_t index) {
  const Stopwatch clock;
  const std::size_t begin = index * kBatchLanes;
  pass.numbering.number(begin, std::min(begin + kBatchLanes, pass.numbering.size()), m_samples);
  m_warp_seconds = 0;
  if (pass.proposal) {
    const Stopwatch drawing;
    draw(pass);
    m_warp_seconds = drawing.wall();
  }
  m_latents.assign(pass.sampler, pass.seed, m_samples.ids, m_samples.indices);
  if (m_samples.have_pixels()) place_on_film(pass.tracer.scene().film);
  trace(pass);
  m_trace_seconds = clock.wall() - m_warp_seconds;
}

void PathBatch::draw(const PathPass& pass) {
  const std::size_t n = m_samples.size(), dims = static_cast<std::size_t>(pass.layout->dims());
  if (m_y.rows() < n) m_y = Matrix<double>(kBatchLanes, dims);
  for (auto* numbers : {&m_z, &m_u, &m_log_q}) numbers->resize(n);
  m_inv_q.resize(n);
  m_warp_latents.assign(pass.sampler, mix64(pass.seed ^ kLatentStream), m_samples.ids, m_samples.indices);
  for (std::size_t c = 0; c < dims; ++c) {
    m_warp_latents.fill(pass.layout->dimension(static_cast<int>(c)), m_z.data());
    for (std::size_t i = 0; i < n; ++i) m_y(i, c) = m_z[i];
  }
  m_warp_latents.fill(kComponentDimension, m_u.data());
  // Where every sample stands for the whole film, components may be stratified over the batch: the share of each is the
  // same in every batch. A pixel of a stratified film needs all of them.
  if (!m_samples.have_pixels())
    for (std::size_t i = 0; i < n; ++i) m_u[i] = (static_cast<double>(i) + m_u[i]) / static_cast<double>(n);
  const auto y = m_y.batch().rows_from(0, n);
  pass.proposal->sample(y, m_u, y, m_log_q);
  for (std::size_t i = 0; i < n; ++i) m_inv_q[i] = static_cast<float>(std::exp(-m_log_q[i]));
}

void PathBatch::place_on_film(const FilmSettings& film) {
  m_film_x.resize(m_samples.size());
  m_film_y.resize(m_samples.size());
  const std::uint32_t d = Group{GroupKind::film}.first_dimension();
  m_latents.fill(d, m_film_x.data());
  m_latents.fill(d + 1, m_film_y.data());
  for (std::size_t i = 0; i < m_samples.size(); ++i)
    place_in_pixel(film, m_samples.pixels[i], m_film_x[i], m_film_y[i]);
}

void PathBatch::trace(const PathPass& pass) {
  if (pass.learner && !m_recorder) m_recorder = pass.learner->make_recorder();
  const auto trace_from = [&](PrimarySource&& source) {
    pass.tracer.trace(source, m_samples.size(), m_results, m_recorder.get());
  };
  if (pass.warp) {
    m_brightness.clear();
    if (!pass.brightness.empty())
      for (const std::uint32_t pixel : m_samples.pixels) m_brightness.push_back(pass.brightness[pixel]);
    trace_from(VertexSource(m_latents, *pass.warp, m_film_x, m_film_y, m_brightness, m_vertices));
  } else if (pass.proposal) {
    trace_from(WarpedSource(m_latents, *pass.layout, m_y.batch(), m_inv_q, m_film_x, m_film_y));
  } else {
    trace_from(WarpedSource(m_latents, m_film_x, m_film_y));
  }
}

}  // namespace warpath
