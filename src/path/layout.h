#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace warpath {

/// The random numbers of a path have names, in the order in which a path uses them.
enum class GroupKind : std::uint8_t {
  film,      ///< 2: position on the film, [0,1)^2 over the crop window, x to the right and y down
  lens,      ///< 2: position on the aperture
  time,      ///< 1: instant between shutter open and close
  light,     ///< 1: which emitter
  light_uv,  ///< 2: where on it, or in which direction
  lobe,      ///< 1: lobe, blend, mask
  dir,       ///< 2: direction within the lobe
  rr         ///< 1: Russian roulette
};

/// Numbers that are drawn together: `film`, `lens`, `time`, or one of the groups of bounce 1, 2, ...
struct Group {
  GroupKind kind;
  std::uint16_t bounce =
      0;  ///< 0 for film, lens and time; else the vertex, counted as Mitsuba's depth: 1 is the first hit

  int size() const;                       ///< how many numbers: 1 or 2
  std::uint32_t first_dimension() const;  ///< place of the first number in a path's own order, see dimension_count
  std::string name() const;               ///< `film`, `bounce2.light_uv`, ...
  bool operator==(const Group&) const = default;
};

inline constexpr std::uint32_t kCameraDimensions = 5;  ///< film, lens, time
inline constexpr std::uint32_t kBounceDimensions = 7;  ///< light, light_uv, lobe, dir, rr: reserved at every vertex

/// The chosen dimensions of a problem: which numbers of a path are warped, and in which column of y each stands.
class Layout {
 public:
  Layout() = default;
  /// `film+bounce1+bounce2.light`; `bounceK` alone means `bounceK.dir`. Columns stand in the order in which a path
  /// uses the numbers, whatever the order of the names. Throws ConfigError, which lists the known names.
  static Layout parse(std::string_view names);

  int dims() const { return static_cast<int>(m_dimensions.size()); }
  std::span<const Group> groups() const { return m_groups; }
  /// First column of y that holds `group`; -1 if it is not among the chosen ones.
  int column(Group group) const;
  bool contains(Group group) const { return column(group) >= 0; }
  /// Column -> place in a path's own order: the counter that its uniform numbers are keyed by.
  std::uint32_t dimension(int column) const { return m_dimensions[static_cast<std::size_t>(column)]; }
  std::string name() const;
  bool operator==(const Layout&) const = default;

 private:
  std::vector<Group> m_groups;
  std::vector<std::uint32_t> m_dimensions;
};

}  // namespace warpath
