#pragma once
#include <cstdint>
#include <vector>

#include "tracer/compiled_scene.h"

namespace warpath {

/// For each pixel of the film's crop window (row-major): 0 if no camera ray through it can meet an emitter first.
/// Emitters' shapes, or boxes around those that are curved or move, are projected; what hides them is not looked at.
std::vector<std::uint8_t> find_emission_mask(const CompiledScene& scene);

}  // namespace warpath
