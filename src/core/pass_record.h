#pragma once
#include <cstdint>
#include <string>

namespace warpath {

/// What was decided for one pass of a render while the clock ran: the same decisions give the same image.
struct PassRecord {
  int spp = 0;
  std::uint64_t batches = 0;  ///< begun before time was up, those of directly seen emission included
  bool teaches = false;       ///< warps learned from it
  std::string drawn_by;       ///< of what `auto` may choose: the method whose warp drew it; empty: uniform numbers
  std::string chosen;         ///< what `auto` chose after it; empty: nothing yet
};

}  // namespace warpath
