#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace warpath {

/// Probability of the first half of a halving, in units of kWholeProbability.
using HalfProbability = std::uint16_t;
inline constexpr int kWholeProbability = 1 << 15;

/// The unit cube of three numbers cut into equal bins by halvings, the numbers taking turns. Bins are numbered by the
/// halvings that lead to them, the first as the highest bit.
///
/// A density is a probability for each node of the tree of halvings. They are stored in subtrees of four levels, which
/// fit half a cache line, so that a sample touches as few lines as can be.
class HalvingGrid {
 public:
  static constexpr int kMaxLevels = 12;
  /// bits[a] halvings cut number a. parts: how many equal parts of the first number are in use, at most 2^bits[0]: its
  /// bins are 1 / parts wide, so that they fit `parts` equally likely choices; those beyond do not exist.
  explicit HalvingGrid(std::array<int, 3> bits, int parts = 0);

  int levels() const { return m_levels; }
  std::uint32_t bins() const { return 1u << m_levels; }  ///< those that do not exist included
  int axis(int level) const { return m_axis[static_cast<std::size_t>(level)]; }
  /// Volume of a bin: 0 if it does not exist.
  float volume(std::uint32_t bin) const { return part_of(bin) < m_parts ? m_volume : 0; }
  std::uint32_t bin(float y0, float y1, float y2) const;
  /// How many numbers a density takes.
  std::size_t stored() const { return m_stored; }

  /// The density whose bins have these masses, bins() of them; not negative, 0 where a bin does not exist. Bins of some
  /// mass keep some.
  void set_density(std::span<const float> masses, HalfProbability* density) const;

  /// One sample on its way from a latent through the tree of halvings, a subtree at a time: between two steps the
  /// memory of the next one is on its way, so that many samples that take turns do not wait for it.
  class Walk {
   public:
    /// Both must outlive the walk.
    void start(const HalvingGrid& grid, const HalfProbability* density, const std::array<double, 3>& z);
    /// Goes on by one subtree; false when there is no further one.
    bool step();
    /// After the last step: y = the point that the density sends the latent to; returns 1 / q(y).
    float finish(std::array<float, 3>& y) const;

   private:
    const HalvingGrid* m_grid;
    const HalfProbability* m_density;
    // Instead of stretching the latent to [0,1) after each halving, `width` keeps track of how wide its range is.
    std::array<double, 3> m_offset, m_width;
    std::array<std::uint32_t, 3> m_place;
    std::uint32_t m_subtree;
    int m_level;
  };
  /// One sample from start to finish.
  float sample(const HalfProbability* density, const std::array<double, 3>& z, std::array<float, 3>& y) const;
  /// 1 / q in a bin.
  float inverse_density(const HalfProbability* density, std::uint32_t bin) const;

 private:
  /// Which of the first number's parts a bin lies in.
  std::uint32_t part_of(std::uint32_t bin) const;

  int m_levels;
  std::uint32_t m_parts;
  std::size_t m_stored;
  float m_volume;  // of a bin that exists
  std::array<int, 3> m_bits;
  std::array<float, 3> m_scale;  // number -> place in units of its bins
  std::array<double, 3> m_unit;  // and back
  std::array<std::uint8_t, kMaxLevels> m_axis{};
};

}  // namespace warpath
