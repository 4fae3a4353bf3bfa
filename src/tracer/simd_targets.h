#pragma once
#include <hwy/highway.h>

// For tests: every kernel of the tracer on each instruction set that it was built for and this CPU has.
namespace warpath::testing {

template <class Body>
void on_every_simd_target(const Body& body) {
  const auto use = [](std::int64_t targets) {
    hwy::SetSupportedTargetsForTest(targets);  // 0 gives the CPU's own back
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  };
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    use(target);
    body();
  }
  use(0);
}

}  // namespace warpath::testing
