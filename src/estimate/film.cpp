#include "estimate/film.h"

#include <algorithm>
#include <cmath>

#include "estimate/reconstruction.h"

namespace warpath {

Film::Film(const FilmSettings& settings, Weights weights, Errors errors)
    : m_width(settings.crop_width),
      m_height(settings.crop_height),
      m_filter(settings.filter),
      m_weights(weights),
      m_errors(errors),
      m_sums(static_cast<std::size_t>(m_width) * static_cast<std::size_t>(m_height)) {
  if (weights == Weights::expected) {
    m_integral_x = filter_integrals(settings.filter, m_width);
    m_integral_y = filter_integrals(settings.filter, m_height);
  }
  const auto taps = static_cast<std::size_t>(2 * std::ceil(m_filter.radius) + 2);
  for (Splat* splat : {&m_splat, &m_other}) {
    splat->x.resize(taps);
    splat->y.resize(taps);
  }
  if (m_errors == Errors::replicates) m_replicates.resize(m_sums.size() * kReplicates);
}

void Film::place(float x, float y, float weight, Splat& splat) const {
  const int own_x = std::min(static_cast<int>(x), m_width - 1), own_y = std::min(static_cast<int>(y), m_height - 1);
  // The box of one pixel takes the sample's own pixel, so that none on a border counts twice.
  const bool own_only = m_filter.type == ReconstructionFilter::Type::box && m_filter.radius <= 0.5f;
  const float r = m_filter.radius;
  splat.x0 = own_only ? own_x : std::max(0, static_cast<int>(std::ceil(x - 0.5f - r)));
  splat.y0 = own_only ? own_y : std::max(0, static_cast<int>(std::ceil(y - 0.5f - r)));
  splat.x1 = own_only ? own_x : std::min(m_width - 1, static_cast<int>(std::floor(x - 0.5f + r)));
  splat.y1 = own_only ? own_y : std::min(m_height - 1, static_cast<int>(std::floor(y - 0.5f + r)));
  for (int i = splat.x0; i <= splat.x1; ++i)
    splat.x[static_cast<std::size_t>(i - splat.x0)] =
        own_only ? 1.0f : filter_weight(m_filter, static_cast<float>(i) + 0.5f - x);
  for (int j = splat.y0; j <= splat.y1; ++j)
    splat.y[static_cast<std::size_t>(j - splat.y0)] =
        weight * (own_only ? 1.0f : filter_weight(m_filter, static_cast<float>(j) + 0.5f - y));
}

void Film::add(float x, float y, const Color& value, float weight, std::uint32_t replicate) {
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

  place(x, y, weight, m_splat);
  for (int j = m_splat.y0; j <= m_splat.y1; ++j)
    for (int i = m_splat.x0; i <= m_splat.x1; ++i) {
      const auto pixel = static_cast<std::size_t>(j * m_width + i);
      const double w = m_splat.weight(i, j);
      Sums& s = m_sums[pixel];
      s.w += w;
      for (int c = 0; c < 3; ++c) s.wf[c] += w * f[c];
      if (m_errors == Errors::neighbours) continue;
      const float v = m_splat.weight(i, j);
      s.w2 += v * v;
      for (int c = 0; c < 3; ++c) {
        const float wf = v * f[c];
        s.w2f2[c] += wf * wf;
        s.w2f[c] += v * wf;
      }
      if (m_replicates.empty()) continue;
      Replicate& r = m_replicates[pixel * kReplicates + replicate];
      r.w += static_cast<float>(w);
      for (int c = 0; c < 3; ++c) r.wf[c] += static_cast<float>(w) * f[c];
    }
}

void Film::add_neighbours(const Sample& a, const Sample& b, double share) {
  if (!std::isfinite(luminance(a.value) + luminance(b.value))) return;
  place(a.x, a.y, 1, m_splat);
  place(b.x, b.y, 1, m_other);
  for (int j = std::min(m_splat.y0, m_other.y0); j <= std::max(m_splat.y1, m_other.y1); ++j)
    for (int i = std::min(m_splat.x0, m_other.x0); i <= std::max(m_splat.x1, m_other.x1); ++i) {
      const double wa = m_splat.weight(i, j), wb = m_other.weight(i, j), w = wa - wb;
      Sums& s = m_sums[static_cast<std::size_t>(j * m_width + i)];
      s.w2 += static_cast<float>(share * w * w);
      for (int c = 0; c < 3; ++c) {
        const double wf = wa * a.value[c] - wb * b.value[c];
        s.w2f2[c] += static_cast<float>(share * wf * wf);
        s.w2f[c] += static_cast<float>(share * w * wf);
      }
    }
}

bool Film::develop(std::size_t pixel, int c, double& mean, double& variance) const {
  const Sums& s = m_sums[pixel];
  if (m_weights == Weights::sampled) {
    if (s.w == 0) return false;
    mean = s.wf[c] / s.w;
    // Ratio estimator, to first order: sum of (w (f - mean))^2 over (sum of w)^2.
    variance = (s.w2f2[c] - 2 * mean * s.w2f[c] + mean * mean * s.w2) / (s.w * s.w);
    // The same with what a replicate sums in the place of w and w f.
    if (!m_replicates.empty() && s.count >= kReplicates) {
      double squares = 0;
      for (std::size_t r = 0; r < kReplicates; ++r) {
        const Replicate& replicate = m_replicates[pixel * kReplicates + r];
        const double residual = replicate.wf[c] - mean * replicate.w;
        squares += residual * residual;
      }
      variance = squares * kReplicates / (kReplicates - 1) / (s.w * s.w);
    }
  } else {
    if (m_samples == 0) return false;
    // Uniform film positions have density 1 over (width x height) pixels.
    const double n = static_cast<double>(m_samples), area = static_cast<double>(m_width) * m_height;
    const auto column = pixel % static_cast<std::size_t>(m_width), row = pixel / static_cast<std::size_t>(m_width);
    const double scale = area / (n * m_integral_x[column] * m_integral_y[row]);
    mean = s.wf[c] * scale;
    variance = (s.w2f2[c] - s.wf[c] * s.wf[c] / n) * scale * scale;
  }
  variance = std::max(0.0, variance);
  return true;
}

void Film::develop(std::size_t begin, std::size_t end, ImageEstimate& image) const {
  image.width = m_width;
  image.height = m_height;
  image.mean.reserve(m_sums.size());
  image.variance.reserve(m_sums.size());
  image.samples.reserve(m_sums.size());
  for (std::size_t p = begin; p < end; ++p) {
    Color mean(0.0f), variance(0.0f);
    double m, v;
    for (int c = 0; c < 3 && develop(p, c, m, v); ++c) {
      mean[c] = static_cast<float>(m);
      variance[c] = static_cast<float>(v);
    }
    image.mean.push_back(mean);
    image.variance.push_back(variance);
    image.samples.push_back(static_cast<float>(m_sums[p].count));
  }
}

ImageEstimate Film::develop() const {
  ImageEstimate image;
  develop(0, m_sums.size(), image);
  return image;
}

ImageEstimate Film::take() {
  constexpr std::size_t kStep = 1 << 14;
  ImageEstimate image;
  for (std::size_t begin = 0; begin < m_sums.size(); begin += kStep) {
    const std::size_t end = std::min(m_sums.size(), begin + kStep);
    develop(begin, end, image);
    m_sums.give_back(begin, end);
  }
  return image;
}

void Film::develop_onto(ImageEstimate& image) const {
  double mean, variance;
  for (std::size_t p = 0; p < m_sums.size(); ++p)
    for (int c = 0; c < 3; ++c) {
      if (!develop(p, c, mean, variance)) break;
      image.mean[p][c] += static_cast<float>(mean);
      image.variance[p][c] += static_cast<float>(variance);
    }
}

}  // namespace warpath
