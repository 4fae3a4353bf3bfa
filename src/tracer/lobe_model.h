#pragma once
#include <type_traits>
#include <variant>

#include "tracer/bsdf_conductor.h"
#include "tracer/bsdf_dielectric.h"
#include "tracer/bsdf_diffuse.h"
#include "tracer/bsdf_null.h"
#include "tracer/bsdf_plastic.h"
#include "tracer/bsdf_principled.h"
#include "tracer/bsdf_rough_conductor.h"
#include "tracer/bsdf_rough_dielectric.h"
#include "tracer/bsdf_rough_plastic.h"

namespace warpath {

/// Any lobe. This is the list of all.
struct LobeModel {
  std::variant<Lobe<Null>, Lobe<Diffuse>, Lobe<Conductor>, Lobe<RoughConductor>, Lobe<Dielectric>, Lobe<ThinDielectric>,
               Lobe<RoughDielectric>, Lobe<Plastic>, Lobe<RoughPlastic>, Lobe<Principled>>
      lobe;
};
static_assert(sizeof(LobeModel) <= 72, "looked at for every vertex");

/// How many numbers are looked up for a lobe.
template <class L>
constexpr int kValueCount = std::is_empty_v<typename L::Values> ? 0 : sizeof(typename L::Values) / sizeof(float);

// Lobe's functions; values as in Scatter::values.
LobeEval eval_lobe(const LobeModel& m, const float* values, const Vec3& wi, const Vec3& wo);
LobeSample sample_lobe(const LobeModel& m, const float* values, const Vec3& wi, float u, const Vec2& dir);
Color lobe_albedo(const LobeModel& m, const float* values, const Vec3& wi);
float lobe_roughness(const LobeModel& m, const float* values);
SurfaceKind lobe_kind(const LobeModel& m, const float* values);

}  // namespace warpath
