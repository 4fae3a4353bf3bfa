#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "estimate/film.h"
#include "tracer/tracer.h"

namespace warpath {

/// Directly seen emission, by camera rays of its own: a jittered grid in each pixel whose filter may reach an emitter.
class EmissionEstimator {
 public:
  /// The tracer must outlive it. pixels: of the crop window, in the order in which they are rendered.
  EmissionEstimator(const Tracer& tracer, std::span<const std::uint32_t> pixels, std::uint64_t seed);

  /// Whether any pixel may see an emitter; else the image is black and add_pass does nothing.
  bool sees_any() const { return m_film.has_value(); }
  /// Adds at least 4 x `spp` rays to each pixel that may see an emitter; where these are few, as many as a quarter of
  /// the paths of the image. stop() is asked before each batch. Returns how many rays were added.
  std::uint64_t add_pass(int spp, const std::function<bool()>& stop);

  ImageEstimate develop() const;
  /// Adds it to an image of the same size.
  void develop_onto(ImageEstimate& image) const;
  std::uint64_t non_finite() const { return m_film ? m_film->non_finite() : 0; }

 private:
  const Tracer& m_tracer;
  std::uint64_t m_seed;
  std::size_t m_image_size;             // pixels of the crop window
  std::vector<std::uint32_t> m_pixels;  // that may see an emitter, in order
  std::optional<Film> m_film;
  std::uint64_t m_begun = 0;  // rays that passes have begun so far: numbers them
};

}  // namespace warpath
