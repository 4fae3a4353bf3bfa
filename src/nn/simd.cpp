#include "nn/simd.h"

#include <hwy/highway.h>

#include "warpath/error.h"

namespace warpath::nn {
namespace {

bool g_forced = false;

void use(std::int64_t targets) {
  g_forced = targets != 0;
  hwy::SetSupportedTargetsForTest(targets);  // 0 gives the CPU's own back
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace

std::vector<std::string> simd_targets() {
  std::vector<std::string> names;
  for (std::int64_t target : hwy::SupportedAndGeneratedTargets()) names.emplace_back(hwy::TargetName(target));
  return names;
}

ForceSimdTarget::ForceSimdTarget(const std::string& name) {
  for (std::int64_t target : hwy::SupportedAndGeneratedTargets())
    if (name == hwy::TargetName(target)) {
      use(target);
      return;
    }
  throw ConfigError(fmt::format("no instruction set \"{}\" on this CPU", name));
}

ForceSimdTarget::~ForceSimdTarget() { use(0); }

bool ForceSimdTarget::any() { return g_forced; }

}  // namespace warpath::nn
