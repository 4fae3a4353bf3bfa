#pragma once
#include <cstdint>
#include <string>

namespace warpath {

/// What stands for uniform numbers where a warp could be named.
inline constexpr char kNoWarp[] = "none";

/// What was decided for one pass of a render: the same decisions give the same image.
struct PassRecord {
  int spp = 0;
  std::uint64_t batches = 0;      ///< begun before time was up, those of directly seen emission included
  bool teaches = false;           ///< the warp learned from it, if it is one that learns
  std::string drawn_by{kNoWarp};  ///< the family that drew it
  std::string chosen;             ///< what `auto` chose after it; empty: it made no choice then
};

}  // namespace warpath
