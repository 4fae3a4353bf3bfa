#pragma once
#include <cstdint>

namespace warpath {

/// What was decided for one pass of a render while the clock ran: the same decisions give the same image.
struct PassRecord {
  int spp = 0;
  std::uint64_t batches = 0;  ///< begun before time was up, those of directly seen emission included
  bool teaches = false;       ///< the warp learned from it
  bool gave_up = false;       ///< after it the warp was given up, as it did not pay
};

}  // namespace warpath
