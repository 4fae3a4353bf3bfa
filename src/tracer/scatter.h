#pragma once
#include <array>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "tracer/frame.h"

namespace warpath {

struct LobeModel;

/// One lobe of a scatter: a BSDF that nests no other, and its share of the mixture.
struct ScatterLobe {
  float weight;               ///< share of the whole, and the probability that it is sampled
  std::uint16_t model;        ///< index into Scatter::models
  std::uint8_t first_value;   ///< where in Scatter::values its looked-up textures begin
  std::uint8_t frame : 4;     ///< 0 is the base frame, k is Scatter::perturbed[k - 1]
  std::uint8_t mirrored : 1;  ///< seen from behind its frame, as its twosided BSDF asks for
};

/// A frame turned by a bump or normal map.
struct PerturbedFrame {
  std::uint8_t first_value;   ///< its normal, and after that s if it follows the tangent
  std::uint8_t outer;         ///< frame that it was turned from
  std::uint8_t mirrored : 1;  ///< whether that one is seen from behind
  std::uint8_t shadowed : 1;  ///< smooth shadow terminator [Estevez et al. 2019, Ray Tracing Gems, chapter 12]
  std::uint8_t follows_tangent : 1;
  std::uint8_t left_handed : 1;
};

/// One BSDF at one point: nested BSDFs resolved to weighted lobes, textures looked up, frame built. Lives for one
/// bounce; copy it as bytes. Blends and masks of any depth are a flat list, in the order in which the lobe number
/// chooses.
struct Scatter {
  static constexpr int kMaxLobes = 5, kMaxValues = 32, kMaxPerturbed = 3;

  const LobeModel* models;  ///< the scene's; outlives the scatter
  Frame frame;              ///< around the shading normal; n is turned towards wi under a twosided BSDF
  Vec3 wi;                  ///< world
  std::uint8_t lobe_count, value_count, perturbed_count;
  bool smooth;  ///< whether light sampling can reach any lobe
  std::array<ScatterLobe, kMaxLobes> lobes;
  std::array<float, kMaxValues> values;
  std::array<PerturbedFrame, kMaxPerturbed> perturbed;
};

/// A frame of the scatter, as it is before any twosided BSDF mirrors it: 0 the base frame, k perturbed[k - 1].
inline Frame scatter_frame(const Scatter& scatter, int frame) {
  if (frame == 0) return scatter.frame;
  const PerturbedFrame& p = scatter.perturbed[frame - 1];
  const float* v = &scatter.values[p.first_value];
  const Vec3 n(v[0], v[1], v[2]);
  return p.follows_tangent ? frame_of_tangent(n, {v[3], v[4], v[5]}, p.left_handed) : frame_of_normal(n);
}
inline Vec3 scatter_normal(const Scatter& scatter, int frame) {
  if (frame == 0) return scatter.frame.n;
  const float* v = &scatter.values[scatter.perturbed[frame - 1].first_value];
  return {v[0], v[1], v[2]};
}

static_assert(std::is_trivially_destructible_v<Scatter> && std::is_standard_layout_v<Scatter>);
static_assert(sizeof(Scatter) <= 240);

}  // namespace warpath
