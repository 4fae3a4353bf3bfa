#include "warp/uniform.h"

#include "family/family.h"
#include "family/load_as.h"
#include "warp/load.h"

namespace warpath {

Family uniform_family() {
  return {"uniform", "the chosen numbers at random",
          JointFamily{.load = load_as<Proposal, Uniform>, .most_dims = kMaxDims}};
}

}  // namespace warpath
