#pragma once
#include <vector>

#include "path/vertex.h"
#include "scene/bsdf.h"
#include "tracer/rough_transmittance.h"
#include "tracer/texture_lookup.h"

namespace warpath {

/// f |cos theta_o| of the non-delta part, and the density with which sampling makes wo.
struct LobeEval {
  Color value{0.0f};
  float pdf = 0;
};

struct LobeSample {
  Vec3 wo{0.0f, 0.0f, 1.0f};
  Color weight{0.0f};  ///< f |cos theta_o| / pdf; 0 if sampling failed
  float pdf = 0;       ///< of this lobe; a probability if delta
  float eta = 1;
  bool delta = false, null = false;
};

/// Where a lobe's values come from: textures of its colours, then of its numbers (-1: left out, 0 everywhere).
struct LobeInputs {
  std::vector<TextureId> colors, numbers;
  bool tangent = false;  ///< the frame must follow the tangent of the surface
};

/// What lobes are compiled with.
struct LobeContext {
  const TextureLookup& textures;
  RoughInterfaces rough_interfaces;
};

/// What the tracer makes of a BSDF of the scene that nests no other: a function of local directions. Each is in a file
/// bsdf_*.h, and has
///
///   Values                                   what is looked up at a point, in the order of inputs(): floats
///   Lobe(bsdf, context)                      computes what is the same everywhere
///   LobeInputs inputs()
///   LobeEval eval(values, wi, wo)
///   LobeSample sample(values, wi, u, dir)    u is Mitsuba's sample1, dir its sample2
///   Color albedo(values, wi)                 approximate share of the light from wi that is scattered
///   float roughness(values)                  0 delta, sqrt(alpha), 1 diffuse
///   SurfaceKind kind(values)
///
/// Directions are unit; any wi and wo are allowed. Meanings, lobe probabilities and the use of the random numbers are
/// those of Mitsuba 3.9; where it samples a lobe in a way that is biased, we say so.
template <class Bsdf>
struct Lobe;

/// Base of lobes none of whose directions light sampling can make.
struct DeltaLobe {
  LobeEval eval(const auto&, const Vec3&, const Vec3&) const { return {}; }
  float roughness(const auto&) const { return 0; }
  SurfaceKind kind(const auto&) const { return SurfaceKind::delta; }
};

}  // namespace warpath
