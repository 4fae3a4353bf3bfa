#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace warpath {

/// Probability of the children of a node up to and with one of them, in units of 1 / kWholeProbability: 15 for each of
/// 16 equal children.
using CumulativeProbability = std::uint8_t;
inline constexpr int kWholeProbability = 240;

/// The unit cube of three numbers cut into equal bins by halvings, the numbers taking turns. Bins are numbered by the
/// halvings that lead to them, the first as the highest bit.
///
/// A density is a tree whose nodes stand for four halvings each: they hold the cumulative probabilities of 16 children,
/// which fit one SIMD register. A byte each is enough: samples are divided by the density as it is stored.
class HalvingGrid {
 public:
  static constexpr int kMaxLevels = 12;
  /// bits[a] halvings cut number a. parts: how many equal parts of the first number are in use, at most 2^bits[0]: its
  /// bins are 1 / parts wide, so that they fit `parts` equally likely choices; those beyond do not exist.
  explicit HalvingGrid(std::array<int, 3> bits, int parts = 0);

  int levels() const { return m_levels; }
  std::uint32_t bins() const { return 1u << m_levels; }  ///< those that do not exist included
  /// Volume of a bin: 0 if it does not exist.
  float volume(std::uint32_t bin) const { return part_of(bin) < m_parts ? m_volume : 0; }
  std::uint32_t bin(float y0, float y1, float y2) const;
  /// How many numbers a density takes.
  std::size_t stored() const { return m_stored; }

  /// The density whose bins have these masses, bins() of them; not negative, 0 where a bin does not exist. Bins of some
  /// mass keep some.
  void set_density(std::span<const float> masses, CumulativeProbability* density) const;
  /// Whether numbers that come from elsewhere are a density.
  bool is_density(std::span<const CumulativeProbability> numbers) const;

  /// One sample on its way from a latent through the tree, a node at a time: between two steps the memory of the next
  /// one is on its way, so that many samples that take turns do not wait for it.
  class Walk {
   public:
    /// Both must outlive the walk.
    void start(const HalvingGrid& grid, const CumulativeProbability* density, const std::array<double, 3>& z);
    /// Goes on by one node; false when there is no further one.
    bool step();
    /// After the last step: y = the point that the density sends the latent to; returns 1 / q(y).
    float finish(std::array<float, 3>& y) const;

   private:
    const HalvingGrid* m_grid;
    const CumulativeProbability* m_density;
    std::array<double, 3> m_z;
    std::array<std::uint32_t, 3> m_place;
    double m_probability;  // of the bin, in units of kWholeProbability to the power of the nodes on its way
    std::uint32_t m_node;
    std::uint32_t m_depth;
  };
  /// One sample from start to finish.
  float sample(const CumulativeProbability* density, const std::array<double, 3>& z, std::array<float, 3>& y) const;
  /// 1 / q in a bin.
  float inverse_density(const CumulativeProbability* density, std::uint32_t bin) const;

 private:
  /// Nodes of the same depth.
  struct Rank {
    std::uint32_t first = 0;   ///< the first one's index
    std::uint32_t levels = 0;  ///< halvings
    std::size_t driver = 0;    ///< which number of the latent chooses the child: each chooses once at most
    std::array<std::array<std::uint32_t, 3>, 16> place{};  ///< what a child adds to the bin's place
  };
  static constexpr int kNodeLevels = 4;
  static constexpr std::uint32_t kChildren = 1u << kNodeLevels;
  static constexpr std::uint32_t kMaxDepth = kMaxLevels / kNodeLevels;
  /// Which of the first number's parts a bin lies in.
  std::uint32_t part_of(std::uint32_t bin) const;
  /// The node of depth `depth` on the way to a bin, and which of its children is.
  std::uint32_t node_above(std::uint32_t bin, std::uint32_t depth) const;
  std::uint32_t child_above(std::uint32_t bin, std::uint32_t depth) const;
  /// The point of a bin that lies at z in [0,1) of its width, and never beyond it.
  std::array<float, 3> point(const std::array<std::uint32_t, 3>& place, const std::array<double, 3>& z) const;

  int m_levels;
  std::uint32_t m_parts;
  std::uint32_t m_depth = 0;  // number of ranks
  std::size_t m_stored;
  float m_volume;  // of a bin that exists
  double m_whole;  // m_volume times kWholeProbability to the power of m_depth
  std::array<int, 3> m_bits;
  std::array<float, 3> m_scale;  // number -> place in units of its bins
  std::array<double, 3> m_unit;  // and back
  std::array<std::uint8_t, kMaxLevels> m_axis{};
  std::array<Rank, kMaxDepth> m_ranks{};
};

}  // namespace warpath
