#pragma once
#include <cstdint>
#include <string>

#include "path/layout.h"
#include "warp/vertex_proposal.h"

namespace warpath {

/// Throws ConfigError unless the groups are those that a warp of vertices draws together:
/// bounceK.light+bounceK.light_uv, bounceK.lobe+bounceK.dir.
void check_decisions(const Layout& numbers);
/// Whether they are such groups, and there are any: a warp over them is conditioned on what a path knows there.
bool are_decisions(const Layout& numbers);
/// Whether they hold those of a vertex; empty stands for all.
bool holds_decision(const Layout& numbers, VertexDecision which, std::uint16_t bounce);
/// Those of a saved warp, under "numbers". Throws FileError.
Layout load_decisions(const TensorFile& file, const std::string& prefix);

}  // namespace warpath
