#include "tracer/lobe_model.h"

#include <cstring>

namespace warpath {

namespace {

/// f(lobe, values) of a lobe and what was looked up for it.
template <class F>
auto visit(const LobeModel& m, const float* numbers, const F& f) {
  return std::visit(
      [&]<class L>(const L& lobe) {
        typename L::Values values;
        std::memcpy(static_cast<void*>(&values), numbers, kValueCount<L> * sizeof(float));
        return f(lobe, values);
      },
      m.lobe);
}

}  // namespace

LobeEval eval_lobe(const LobeModel& m, const float* values, const Vec3& wi, const Vec3& wo) {
  return visit(m, values, [&](const auto& lobe, const auto& v) { return lobe.eval(v, wi, wo); });
}

LobeSample sample_lobe(const LobeModel& m, const float* values, const Vec3& wi, float u, const Vec2& dir) {
  return visit(m, values, [&](const auto& lobe, const auto& v) { return lobe.sample(v, wi, u, dir); });
}

Color lobe_albedo(const LobeModel& m, const float* values, const Vec3& wi) {
  return visit(m, values, [&](const auto& lobe, const auto& v) { return lobe.albedo(v, wi); });
}

float lobe_roughness(const LobeModel& m, const float* values) {
  return visit(m, values, [](const auto& lobe, const auto& v) { return lobe.roughness(v); });
}

SurfaceKind lobe_kind(const LobeModel& m, const float* values) {
  return visit(m, values, [](const auto& lobe, const auto& v) { return lobe.kind(v); });
}

}  // namespace warpath
