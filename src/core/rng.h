#pragma once
#include <cstdint>

namespace warpath {

/// Finaliser of SplitMix64 (Steele, Lea, Flood 2014, variant 13): a bijection of 64 bits without visible structure.
inline std::uint64_t mix64(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Key of one sample's stream. Its number `d` is a function of (seed, id, d) alone, so threads cannot change it.
inline std::uint64_t sample_key(std::uint64_t seed, std::uint64_t id) {
  return mix64(mix64(seed + 0x9e3779b97f4a7c15u) ^ (id * 0xd1342543de82ef95u + 0x632be59bd9b4e019u));
}
/// 64 random bits, number `d` of a sample's stream.
inline std::uint64_t sample_bits(std::uint64_t key, std::uint32_t d) {
  return mix64(key + (static_cast<std::uint64_t>(d) + 1) * 0x9e3779b97f4a7c15u);
}
/// Uniform in [0,1): 24 and 53 random bits. Both are roundings of the same number, so a float path and a double y
/// agree.
inline float to_unit_float(std::uint64_t bits) {
  return static_cast<float>(static_cast<std::int32_t>(bits >> 40)) * 0x1p-24f;
}
inline double to_unit_double(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }
inline float sample_float(std::uint64_t key, std::uint32_t d) { return to_unit_float(sample_bits(key, d)); }
inline double sample_double(std::uint64_t key, std::uint32_t d) { return to_unit_double(sample_bits(key, d)); }

/// Primary sample in double to the float that the tracer uses: the nearest in [0,1).
inline float to_primary(double y) {
  const float f = static_cast<float>(y);
  return f < 1.0f ? (f < 0.0f ? 0.0f : f) : 0x1.fffffep-1f;
}

}  // namespace warpath
