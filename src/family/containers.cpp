#include "family/family.h"
#include "warp/chain.h"
#include "warp/mixture.h"

namespace warpath {

Family chain_family() {
  return {"chain", "one warp behind another", Container{[](const TensorFile& file, const std::string& prefix) {
            return std::shared_ptr<const Proposal>(Chain::load(file, prefix, load_proposal));
          }}};
}

Family mixture_family() {
  return {"mixture", "several proposals, each with its share",
          Container{[](const TensorFile& file, const std::string& prefix) {
            return std::shared_ptr<const Proposal>(Mixture::load(file, prefix, load_proposal));
          }}};
}

}  // namespace warpath
