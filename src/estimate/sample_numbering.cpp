#include "estimate/sample_numbering.h"

#include <algorithm>

#include "estimate/film.h"

namespace warpath {
namespace {

/// Appends a sample of a stratified film of so many pixels. in_pixel: its number among all of its pixel; in_sequence:
/// among those that share the pixel's sequences number `sequence`.
void add_sample(NumberedSamples& samples, Sampler sampler, std::size_t pixels, std::uint32_t pixel,
                std::uint64_t in_pixel, std::uint64_t sequence, std::uint64_t in_sequence) {
  samples.pixels.push_back(pixel);
  if (sampler == Sampler::independent) {
    samples.ids.push_back(in_pixel * pixels + pixel);
    return;
  }
  const std::uint64_t replicate = in_pixel % kReplicates;
  samples.ids.push_back((sequence * kReplicates + replicate) * pixels + pixel);
  samples.indices.push_back(static_cast<std::uint32_t>(in_sequence / kReplicates));
  samples.replicates.push_back(static_cast<std::uint32_t>(replicate));
}

}  // namespace

void NumberedSamples::clear() {
  ids.clear();
  for (auto* numbers : {&indices, &pixels, &replicates}) numbers->clear();
  weights.clear();
}

void BegunSamples::add(int pass_spp) {
  for (std::uint32_t& begun : in_pixel) begun += static_cast<std::uint32_t>(pass_spp);
  spp += static_cast<std::uint64_t>(pass_spp);
}

void BegunSamples::add(int pass_spp, std::span<const std::uint32_t> counts) {
  for (std::size_t pixel = 0; pixel < in_pixel.size(); ++pixel) in_pixel[pixel] += counts[pixel];
  spp += static_cast<std::uint64_t>(pass_spp);
}

JointNumbering::JointNumbering(std::size_t pixels, const BegunSamples& begun, int spp)
    : m_first(begun.spp * pixels), m_size(pixels * static_cast<std::size_t>(spp)) {}

void JointNumbering::number(std::size_t begin, std::size_t end, NumberedSamples& samples) const {
  samples.clear();
  for (std::size_t i = begin; i < end; ++i) samples.ids.push_back(m_first + i);
}

PlainNumbering::PlainNumbering(std::span<const std::uint32_t> pixels, const BegunSamples& begun, Sampler sampler,
                               int spp)
    : m_pixels(pixels), m_begun(begun), m_sampler(sampler), m_spp(static_cast<std::size_t>(spp)) {}

void PlainNumbering::number(std::size_t begin, std::size_t end, NumberedSamples& samples) const {
  samples.clear();
  for (std::size_t i = begin; i < end; ++i) {
    const std::uint32_t pixel = m_pixels[i / m_spp];
    const std::uint64_t in_pixel = m_begun.in_pixel[pixel] + i % m_spp;
    add_sample(samples, m_sampler, m_pixels.size(), pixel, in_pixel, 0, in_pixel);
  }
}

GuidedNumbering::GuidedNumbering(std::span<const std::uint32_t> pixels, const BegunSamples& begun, Sampler sampler,
                                 int spp, std::span<const std::uint32_t> counts, float weight)
    : m_pixels(pixels),
      m_begun(begun),
      m_sampler(sampler),
      m_counts(counts),
      m_pixel_weight(weight * static_cast<float>(spp)),
      m_begin{0} {
  m_begin.reserve(pixels.size() + 1);
  for (const std::uint32_t pixel : pixels) m_begin.push_back(m_begin.back() + counts[pixel]);
}

void GuidedNumbering::number(std::size_t begin, std::size_t end, NumberedSamples& samples) const {
  samples.clear();
  const std::uint64_t sequence = m_begun.spp + 1;  // 0 are those of plain passes
  auto k = static_cast<std::size_t>(std::upper_bound(m_begin.begin(), m_begin.end(), begin) - m_begin.begin()) - 1;
  for (std::size_t i = begin; i < end; ++i) {
    while (i >= m_begin[k + 1]) ++k;
    const std::uint32_t pixel = m_pixels[k];
    const std::uint64_t in_pass = i - m_begin[k];
    add_sample(samples, m_sampler, m_pixels.size(), pixel, m_begun.in_pixel[pixel] + in_pass, sequence, in_pass);
    samples.weights.push_back(m_pixel_weight / static_cast<float>(m_counts[pixel]));
  }
}

}  // namespace warpath
