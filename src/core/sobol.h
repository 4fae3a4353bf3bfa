#pragma once
#include <cstdint>

#include "core/rng.h"

namespace warpath {

inline constexpr int kSobolDimensions = 256;

/// Point `index` of the Sobol' sequence in one dimension (0 ... kSobolDimensions - 1), as 32 bits of a binary fraction.
/// Random access; index 0 is the origin. Direction numbers are Boost's (Joe and Kuo 2003).
std::uint32_t sobol_bits(std::uint32_t index, int dimension);

inline std::uint32_t reverse_bits(std::uint32_t x) {
  x = __builtin_bswap32(x);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
  x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
  return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

/// Owen's nested uniform scrambling by a hash: each bit is flipped as a function of the bits above it.  [Owen95]; the
/// hash is that of Burley 2020, "Practical Hash-based Owen Scrambling", after Laine and Karras 2011.
inline std::uint32_t owen_scramble(std::uint32_t bits, std::uint32_t seed) {
  std::uint32_t x = reverse_bits(bits);
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return reverse_bits(x);
}

/// Shuffles the order of a sequence so that every aligned run of 2^k points remains one (nested, as Owen's): two blocks
/// of dimensions that take differently shuffled indices have nothing to do with each other.
inline std::uint32_t shuffle_index(std::uint32_t index, std::uint32_t seed) { return owen_scramble(index, seed); }

}  // namespace warpath
