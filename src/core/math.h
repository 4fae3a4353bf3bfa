#pragma once
#include <Imath/ImathColor.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <cmath>
#include <numbers>

namespace warpath {

using Vec2 = Imath::V2f;
using Vec3 = Imath::V3f;
using Color = Imath::C3f;  ///< linear RGB, Rec. 709 primaries
/// Imath's convention: row vectors, p' = p * M, so this is the transpose of the matrix in a scene file.
using Matrix4 = Imath::M44f;

inline constexpr float kPi = std::numbers::pi_v<float>;
/// The largest float below 1: primary samples stay in [0,1).
inline constexpr float kOneMinusEpsilon = 0x1.fffffep-1f;

/// Luminance of linear Rec. 709 RGB (ITU-R BT.709).
inline float luminance(const Color& c) { return 0.212671f * c.x + 0.715160f * c.y + 0.072169f * c.z; }
/// The larger and the smaller of two; the first if either is NaN. One instruction each, where std::fmax is a call.
inline float larger(float a, float b) { return b > a ? b : a; }
inline float smaller(float a, float b) { return b < a ? b : a; }
inline float max_component(const Color& c) { return larger(c.x, larger(c.y, c.z)); }
/// v over its length, by one division; Imath's own minds vectors whose square underflows, and is slow.
inline Vec3 unit(const Vec3& v) { return v * (1 / std::sqrt(v.dot(v))); }
inline float sqr(float x) { return x * x; }
inline float clamp01(float x) { return smaller(1.0f, larger(0.0f, x)); }

}  // namespace warpath
