#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace warpath {

/// How the uniform numbers of a pixel's samples lie to each other.
enum class Sampler : std::uint8_t {
  independent,  ///< not at all
  stratified,   ///< the one or two numbers of each group form a (0,1)- or (0,2)-sequence
  sobol         ///< all numbers that are drawn for one decision form a Sobol' sequence
};
const char* sampler_name(Sampler sampler);

/// Numbers of this place and beyond belong to no group of a path; each is a block of its own.
inline constexpr std::uint32_t kFirstFreeDimension = 0x80000000u;

/// The uniform numbers of a batch of samples, a dimension at a time.
///
/// A path has more dimensions than a good sequence, so sequences are padded [Burley20]: the dimensions fall into blocks
/// (film, lens and time; at each vertex light and light_uv, lobe and dir, and rr), and each block of each stream walks
/// a low-dimensional Owen-scrambled Sobol' sequence in an order of its own. So the numbers of a block are well spread,
/// and those of different blocks and streams have nothing to do with each other. Every number is uniform by itself.
class Latents {
 public:
  Latents() = default;
  /// Independent numbers: lane i is sample ids[i] of this seed.
  Latents(std::uint64_t seed, std::span<const std::uint64_t> ids) { assign(seed, ids); }

  void assign(std::uint64_t seed, std::span<const std::uint64_t> ids);
  /// Lane i is point indices[i] of the sequences of streams[i]. Streams are independent of each other.
  void assign(Sampler sampler, std::uint64_t seed, std::span<const std::uint64_t> streams,
              std::span<const std::uint32_t> indices);

  /// Number `dimension` of each of `lanes`, in [0,1). Float and double are roundings of the same number.
  void fill(std::uint32_t dimension, std::span<const std::uint32_t> lanes, float* numbers) const;
  void fill(std::uint32_t dimension, std::span<const std::uint32_t> lanes, double* numbers) const;
  /// The same for all lanes of the batch.
  void fill(std::uint32_t dimension, float* numbers) const;
  void fill(std::uint32_t dimension, double* numbers) const;

  std::size_t size() const { return m_keys.size(); }

 private:
  template <class T, class LaneOf>
  void fill(std::uint32_t dimension, std::size_t count, const LaneOf& lane_of, T* numbers) const;

  Sampler m_sampler = Sampler::independent;
  std::vector<std::uint64_t> m_keys;     // of each lane's stream
  std::vector<std::uint32_t> m_indices;  // empty if independent
};

}  // namespace warpath
