#include "core/sobol.h"

#include <array>
#include <bit>
#include <boost/random/sobol.hpp>

namespace warpath {
namespace {

/// What each value of each byte of an index contributes: four look-ups instead of a loop over 32 bits.
using ByteTables = std::array<std::array<std::array<std::uint32_t, 256>, 4>, kSobolDimensions>;

/// Direction numbers v_1 ... v_32 of a dimension, highest bit first [Bratley and Fox 1988, section 2].
std::array<std::uint32_t, 32> direction_numbers(int dimension) {
  std::array<std::uint32_t, 32> v{};
  if (dimension == 0) {
    for (unsigned k = 0; k < 32; ++k) v[k] = 1u << (31 - k);
    return v;
  }
  using Table = boost::random::default_sobol_table;
  const auto polynomial = static_cast<std::uint32_t>(Table::polynomial(static_cast<std::size_t>(dimension - 1)));
  const auto degree = static_cast<unsigned>(std::bit_width(polynomial)) - 1;
  std::array<std::uint64_t, 32> m{};
  for (unsigned k = 0; k < 32; ++k) {
    if (k < degree) {
      m[k] = static_cast<std::uint64_t>(Table::minit(static_cast<std::size_t>(dimension - 1), k));
    } else {
      // m_k = XOR over i of 2^i a_i m_(k-i), and m_(k-degree) once more; a_i are the polynomial's inner coefficients.
      m[k] = m[k - degree];
      for (unsigned i = 1; i <= degree; ++i)
        if ((polynomial >> (degree - i)) & 1u) m[k] ^= m[k - i] << i;
    }
    v[k] = static_cast<std::uint32_t>(m[k] << (31 - k));
  }
  return v;
}

ByteTables make_tables() {
  ByteTables tables{};
  for (int d = 0; d < kSobolDimensions; ++d) {
    const auto v = direction_numbers(d);
    for (unsigned byte = 0; byte < 4; ++byte)
      for (unsigned value = 1; value < 256; ++value) {
        const auto lowest = static_cast<unsigned>(std::countr_zero(value));
        auto& table = tables[static_cast<std::size_t>(d)][byte];
        table[value] = table[value & (value - 1)] ^ v[8 * byte + lowest];
      }
  }
  return tables;
}

const ByteTables kTables = make_tables();

}  // namespace

std::uint32_t sobol_bits(std::uint32_t index, int dimension) {
  const auto& t = kTables[static_cast<std::size_t>(dimension)];
  return t[0][index & 255u] ^ t[1][(index >> 8) & 255u] ^ t[2][(index >> 16) & 255u] ^ t[3][index >> 24];
}

}  // namespace warpath
