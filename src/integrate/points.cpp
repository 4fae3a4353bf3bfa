#include "integrate/points.h"

#include <algorithm>

#include "core/rng.h"
#include "core/sobol.h"
#include "warpath/error.h"

namespace warpath {
namespace {

constexpr std::size_t kReplicates = 16;  // at least; fewer than twice as many
constexpr std::size_t kSecond = 32;      // main points for each of the second component

}  // namespace

Points::Points(Kind kind, std::uint64_t seed, std::uint64_t iteration, std::size_t count, bool defended)
    : m_kind(kind), m_seed(sample_key(seed, iteration)), m_defended(defended) {
  if (kind == Kind::independent) {
    m_replicates = count;
    return;
  }
  const auto second = [&](std::size_t main) { return defended ? std::max<std::size_t>(1, main / kSecond) : 0; };
  while (kReplicates * (2 * m_main + second(2 * m_main)) <= count) m_main *= 2;
  m_second = second(m_main);
  m_replicates = count / replicate_size();
}

double Points::second_share() const {
  if (!m_defended) return 0;
  if (m_kind == Kind::independent) return kSecondShare;
  return static_cast<double>(m_second) / static_cast<double>(replicate_size());
}

void Points::fill(std::size_t first, Batch<double> z, std::span<double> u) const {
  const auto dims = static_cast<std::uint32_t>(z.cols());
  if (m_kind == Kind::independent) {
    for (std::size_t i = 0; i < z.rows(); ++i) {
      const std::uint64_t key = sample_key(m_seed, first + i);
      for (std::uint32_t d = 0; d < dims; ++d) z(i, d) = sample_double(key, d);
      u[i] = sample_double(key, dims);
    }
    return;
  }
  WARPATH_CHECK(dims <= static_cast<std::uint32_t>(kSobolDimensions));
  const double main_share = 1 - second_share();
  std::vector<std::uint32_t> scramble(dims);
  std::size_t sequence = ~std::size_t{0};
  for (std::size_t i = 0; i < z.rows(); ++i) {
    const std::size_t replicate = (first + i) / replicate_size(), within = (first + i) % replicate_size();
    const bool of_second = within >= m_main;
    if (const std::size_t now = 2 * replicate + of_second; now != sequence) {
      sequence = now;
      const std::uint64_t key = sample_key(m_seed, sequence);
      for (std::uint32_t d = 0; d < dims; ++d) scramble[d] = static_cast<std::uint32_t>(sample_bits(key, d));
    }
    const auto index = static_cast<std::uint32_t>(of_second ? within - m_main : within);
    for (std::uint32_t d = 0; d < dims; ++d) {
      const std::uint32_t bits = owen_scramble(sobol_bits(index, static_cast<int>(d)), scramble[d]);
      // Below the 32 bits of the sequence a double has random ones.
      const std::uint64_t low = mix64((static_cast<std::uint64_t>(scramble[d]) << 32) ^ index) >> 32;
      z(i, d) = to_unit_double(static_cast<std::uint64_t>(bits) << 32 | low);
    }
    u[i] = of_second ? (1 + main_share) / 2 : main_share / 2;
  }
}

}  // namespace warpath
