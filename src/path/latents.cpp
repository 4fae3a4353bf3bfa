#include "path/latents.h"

#include <algorithm>
#include <array>
#include <type_traits>

#include "core/rng.h"
#include "core/sobol.h"
#include "path/layout.h"

namespace warpath {
namespace {

/// Place of a dimension within its block.
int place_in_block(Sampler sampler, std::uint32_t dimension) {
  constexpr std::array<int, kCameraDimensions> kCamera{0, 1, 2, 3, 4}, kCameraGroups{0, 1, 0, 1, 0};
  constexpr std::array<int, kBounceDimensions> kBounce{0, 1, 2, 0, 1, 2, 0}, kBounceGroups{0, 0, 1, 0, 0, 1, 0};
  const bool wide = sampler == Sampler::sobol;
  if (dimension >= kFirstFreeDimension) return 0;
  if (dimension < kCameraDimensions) return (wide ? kCamera : kCameraGroups)[dimension];
  return (wide ? kBounce : kBounceGroups)[(dimension - kCameraDimensions) % kBounceDimensions];
}

template <class T>
T to_unit(std::uint64_t bits) {
  if constexpr (std::is_same_v<T, float>) {
    return to_unit_float(bits);
  } else {
    return to_unit_double(bits);
  }
}

}  // namespace

const char* sampler_name(Sampler sampler) {
  constexpr std::array<const char*, 3> kNames{"independent", "stratified", "sobol"};
  return kNames[static_cast<std::size_t>(sampler)];
}

void Latents::assign(std::uint64_t seed, std::span<const std::uint64_t> ids) {
  assign(Sampler::independent, seed, ids, {});
}

void Latents::assign(Sampler sampler, std::uint64_t seed, std::span<const std::uint64_t> streams,
                     std::span<const std::uint32_t> indices) {
  m_sampler = sampler;
  m_keys.resize(streams.size());
  for (std::size_t i = 0; i < streams.size(); ++i) m_keys[i] = sample_key(seed, streams[i]);
  m_indices.assign(indices.begin(), indices.end());
}

template <class T, class LaneOf>
void Latents::fill(std::uint32_t dimension, std::size_t count, const LaneOf& lane_of, T* numbers) const {
  if (m_sampler == Sampler::independent) {
    // Keys first, so that the hash of several is computed at once.
    constexpr std::size_t kChunk = 64;
    std::array<std::uint64_t, kChunk> keys;
    for (std::size_t first = 0; first < count; first += kChunk) {
      const std::size_t n = std::min(kChunk, count - first);
      for (std::size_t i = 0; i < n; ++i) keys[i] = m_keys[lane_of(first + i)];
      T* out = numbers + first;
      for (std::size_t i = 0; i < n; ++i) out[i] = to_unit<T>(sample_bits(keys[i], dimension));
    }
    return;
  }
  const int place = place_in_block(m_sampler, dimension);
  const std::uint32_t block = dimension - static_cast<std::uint32_t>(place);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t lane = lane_of(i);
    const std::uint64_t key = sample_bits(m_keys[lane], block);
    const std::uint32_t index = shuffle_index(m_indices[lane], static_cast<std::uint32_t>(key));
    const std::uint64_t scramble = sample_bits(key, static_cast<std::uint32_t>(place));
    const std::uint32_t bits = owen_scramble(sobol_bits(index, place), static_cast<std::uint32_t>(scramble));
    // Below the 32 bits of the sequence a double has random ones.
    std::uint64_t low = 0;
    if constexpr (std::is_same_v<T, double>) low = mix64(scramble ^ index) >> 32;
    numbers[i] = to_unit<T>(static_cast<std::uint64_t>(bits) << 32 | low);
  }
}

void Latents::fill(std::uint32_t dimension, std::span<const std::uint32_t> lanes, float* numbers) const {
  fill(
      dimension, lanes.size(), [&](std::size_t i) { return lanes[i]; }, numbers);
}
void Latents::fill(std::uint32_t dimension, std::span<const std::uint32_t> lanes, double* numbers) const {
  fill(
      dimension, lanes.size(), [&](std::size_t i) { return lanes[i]; }, numbers);
}
void Latents::fill(std::uint32_t dimension, float* numbers) const {
  fill(
      dimension, size(), [](std::size_t i) { return i; }, numbers);
}
void Latents::fill(std::uint32_t dimension, double* numbers) const {
  fill(
      dimension, size(), [](std::size_t i) { return i; }, numbers);
}

}  // namespace warpath
