#include "estimate/film.h"

#include <algorithm>
#include <cmath>

#include "estimate/reconstruction.h"

namespace warpath {

Film::Film(const FilmSettings& settings, Weights weights)
    : m_width(settings.crop_width),
      m_height(settings.crop_height),
      m_filter(settings.filter),
      m_weights(weights),
      m_sums(static_cast<std::size_t>(m_width) * static_cast<std::size_t>(m_height)),
      m_integral_x(filter_integrals(settings.filter, m_width)),
      m_integral_y(filter_integrals(settings.filter, m_height)) {
  const auto taps = static_cast<std::size_t>(2 * std::ceil(m_filter.radius) + 2);
  m_weight_x.resize(taps);
  m_weight_y.resize(taps);
}

void Film::add(float x, float y, const Color& value, float weight) {
  ++m_samples;
  Color f = value;
  if (!std::isfinite(f.x + f.y + f.z)) {
    f = Color(0.0f);
    ++m_non_finite;
  }
  const int own_x = std::min(static_cast<int>(x), m_width - 1), own_y = std::min(static_cast<int>(y), m_height - 1);
  m_sums[static_cast<std::size_t>(own_y * m_width + own_x)].count += 1;
  // A black sample changes nothing where the divisor is known beforehand.
  if (m_weights == Weights::expected && f == Color(0.0f)) return;

  // The box of one pixel takes the sample's own pixel, so that none on a border counts twice.
  const bool own_only = m_filter.type == ReconstructionFilter::Type::box && m_filter.radius <= 0.5f;
  const float r = m_filter.radius;
  const int x0 = own_only ? own_x : std::max(0, static_cast<int>(std::ceil(x - 0.5f - r)));
  const int y0 = own_only ? own_y : std::max(0, static_cast<int>(std::ceil(y - 0.5f - r)));
  const int x1 = own_only ? own_x : std::min(m_width - 1, static_cast<int>(std::floor(x - 0.5f + r)));
  const int y1 = own_only ? own_y : std::min(m_height - 1, static_cast<int>(std::floor(y - 0.5f + r)));
  for (int i = x0; i <= x1; ++i)
    m_weight_x[static_cast<std::size_t>(i - x0)] =
        own_only ? 1.0f : filter_weight(m_filter, static_cast<float>(i) + 0.5f - x);
  for (int j = y0; j <= y1; ++j)
    m_weight_y[static_cast<std::size_t>(j - y0)] =
        weight * (own_only ? 1.0f : filter_weight(m_filter, static_cast<float>(j) + 0.5f - y));

  for (int j = y0; j <= y1; ++j)
    for (int i = x0; i <= x1; ++i) {
      const double w = m_weight_x[static_cast<std::size_t>(i - x0)] * m_weight_y[static_cast<std::size_t>(j - y0)];
      Sums& s = m_sums[static_cast<std::size_t>(j * m_width + i)];
      s.w += w;
      s.w2 += w * w;
      for (int c = 0; c < 3; ++c) {
        const double wf = w * f[c];
        s.wf[c] += wf;
        s.w2f2[c] += wf * wf;
        s.w2f[c] += w * wf;
      }
    }
}

ImageEstimate Film::develop() const {
  ImageEstimate image;
  image.width = m_width;
  image.height = m_height;
  image.mean.resize(m_sums.size(), Color(0.0f));
  image.variance.resize(m_sums.size(), Color(0.0f));
  image.samples.resize(m_sums.size());
  const double n = static_cast<double>(m_samples);
  // Uniform film positions have density 1 over (width x height) pixels.
  const double area = static_cast<double>(m_width) * m_height;
  for (std::size_t p = 0; p < m_sums.size(); ++p) {
    const Sums& s = m_sums[p];
    const auto column = p % static_cast<std::size_t>(m_width), row = p / static_cast<std::size_t>(m_width);
    image.samples[p] = static_cast<float>(s.count);
    for (int c = 0; c < 3; ++c) {
      double mean = 0, variance = 0;
      if (m_weights == Weights::sampled) {
        if (s.w == 0) continue;
        mean = s.wf[c] / s.w;
        // Ratio estimator, to first order: sum of (w (f - mean))^2 over (sum of w)^2.
        variance = (s.w2f2[c] - 2 * mean * s.w2f[c] + mean * mean * s.w2) / (s.w * s.w);
      } else {
        if (n == 0) continue;
        const double scale = area / (n * m_integral_x[column] * m_integral_y[row]);
        mean = s.wf[c] * scale;
        variance = (s.w2f2[c] - s.wf[c] * s.wf[c] / n) * scale * scale;
      }
      image.mean[p][c] = static_cast<float>(mean);
      image.variance[p][c] = static_cast<float>(std::max(0.0, variance));
    }
  }
  return image;
}

}  // namespace warpath
