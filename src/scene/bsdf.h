#pragma once
#include <cstdint>
#include <string>
#include <variant>

#include "scene/texture.h"

namespace warpath {

// BSDFs as scene files describe them, with Mitsuba 3's names, defaults and meanings; the tracer compiles them.
// Those that let light through, other than by what they nest, say so: transmits().
using BsdfId = std::int32_t;  ///< index into Scene::bsdfs

enum class MicrofacetType : std::uint8_t { beckmann, ggx };

struct Diffuse {
  TextureId reflectance;
};
struct Conductor {
  Color eta{0.0f}, k{1.0f};  ///< complex index over that of the outside; 0 and 1 is the perfect mirror ("none")
  TextureId specular_reflectance;
};
struct RoughConductor {
  MicrofacetType distribution = MicrofacetType::beckmann;
  TextureId alpha_u, alpha_v;
  bool sample_visible = true;
  Color eta{0.0f}, k{1.0f};
  TextureId specular_reflectance;
};
struct Dielectric {
  float eta = 1.5046f / 1.000277f;  ///< inside over outside
  TextureId specular_reflectance, specular_transmittance;
  bool transmits() const { return true; }
};
struct ThinDielectric {
  float eta = 1.5046f / 1.000277f;
  TextureId specular_reflectance, specular_transmittance;
  bool transmits() const { return true; }
};
struct RoughDielectric {
  MicrofacetType distribution = MicrofacetType::beckmann;
  TextureId alpha_u, alpha_v;
  bool sample_visible = true;
  float eta = 1.5046f / 1.000277f;
  TextureId specular_reflectance, specular_transmittance;
  bool transmits() const { return true; }
};
struct Plastic {
  float eta = 1.49f / 1.000277f;
  TextureId diffuse_reflectance, specular_reflectance;
  bool nonlinear = false;
};
struct RoughPlastic {
  MicrofacetType distribution = MicrofacetType::beckmann;
  float alpha = 0.1f;
  bool sample_visible = true;
  float eta = 1.49f / 1.000277f;
  TextureId diffuse_reflectance, specular_reflectance;
  bool nonlinear = false;
};
/// Mitsuba 3's `principled`; eta or specular sets the index of refraction.
struct Principled {
  TextureId base_color, roughness;
  /// -1: the scene file leaves the lobe out, or sets it to 0.
  TextureId anisotropic = -1, metallic = -1, spec_trans = -1, spec_tint = -1, sheen = -1, sheen_tint = -1,
            flatness = -1, clearcoat = -1;
  TextureId clearcoat_gloss = -1;
  float eta = 1.5f;  ///< inside over outside, already computed from `specular` where that is given
  float diffuse_reflectance_sampling_rate = 1, main_specular_sampling_rate = 1, clearcoat_sampling_rate = 1;
  bool transmits() const { return spec_trans >= 0; }
};
struct TwoSided {
  BsdfId front, back;
};
struct Mask {
  BsdfId nested;
  TextureId opacity;
  bool transmits() const { return true; }
};
struct BlendBsdf {
  BsdfId first, second;
  TextureId weight;  ///< of the second
};
struct BumpMap {
  BsdfId nested;
  TextureId displacement;
  float scale = 1;
  bool flip_invalid_normals = true;    ///< turn normals that face away from the ray
  bool use_shadowing_function = true;  ///< smooth shadow terminator
};
struct NormalMap {
  BsdfId nested;
  TextureId normalmap;  ///< raw RGB, n = 2 rgb - 1
  bool flip_invalid_normals = true;
  bool use_shadowing_function = true;
};
struct Null {
  bool transmits() const { return true; }
};

struct Bsdf {
  std::string id;
  std::variant<Diffuse, Conductor, RoughConductor, Dielectric, ThinDielectric, RoughDielectric, Plastic, RoughPlastic,
               Principled, TwoSided, Mask, BlendBsdf, BumpMap, NormalMap, Null>
      model;
};

}  // namespace warpath
