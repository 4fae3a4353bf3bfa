#pragma once
#include "tracer/lobe.h"

namespace warpath {

template <>
struct Lobe<Null> : DeltaLobe {
  struct Values {};
  Lobe() = default;
  Lobe(const Null&, LobeContext&) {}
  LobeInputs inputs() const { return {}; }
  LobeSample sample(const Values&, const Vec3& wi, float, const Vec2&) const {
    return {.wo = -wi, .weight = Color(1.0f), .pdf = 1, .delta = true, .null = true};
  }
  Color albedo(const Values&, const Vec3&) const { return Color(1.0f); }
  SurfaceKind kind(const Values&) const { return SurfaceKind::null; }
};

}  // namespace warpath
