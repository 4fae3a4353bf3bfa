#pragma once
#include <string>
#include <utility>
#include <vector>

#include "scene/scene.h"
#include "tracer/frame.h"
#include "tracer/material.h"

namespace warpath::test {

/// Puts BSDFs and textures of a test together.
class BsdfBuilder {
 public:
  TextureId color(float r, float g, float b) { return texture(ConstantTexture{Color(r, g, b)}); }
  TextureId value(float v) { return color(v, v, v); }
  TextureId texture(Texture t) {
    scene.textures.push_back(std::move(t));
    return static_cast<TextureId>(scene.textures.size()) - 1;
  }
  template <class Model>
  BsdfId add(Model model) {
    scene.bsdfs.push_back({"bsdf" + std::to_string(scene.bsdfs.size()), std::move(model)});
    return static_cast<BsdfId>(scene.bsdfs.size()) - 1;
  }

  BsdfId diffuse(float r = 0.8f, float g = 0.6f, float b = 0.3f) { return add(Diffuse{color(r, g, b)}); }
  BsdfId mirror() { return add(Conductor{Color(0.0f), Color(1.0f), value(1)}); }
  BsdfId rough_conductor(MicrofacetType d, float alpha_u, float alpha_v, bool visible = true) {
    const TextureId u = value(alpha_u);
    return add(RoughConductor{d, u, alpha_u == alpha_v ? u : value(alpha_v), visible, Color(0.2f, 0.9f, 1.4f),
                              Color(3.9f, 2.4f, 1.7f), value(1)});
  }
  BsdfId dielectric(float eta) { return add(Dielectric{eta, value(1), value(1)}); }
  BsdfId rough_dielectric(MicrofacetType d, float alpha_u, float alpha_v, float eta, bool visible = true) {
    const TextureId u = value(alpha_u);
    return add(RoughDielectric{d, u, alpha_u == alpha_v ? u : value(alpha_v), visible, eta, value(1), value(1)});
  }
  BsdfId plastic(bool nonlinear = false) { return add(Plastic{1.5f, color(0.1f, 0.4f, 0.7f), value(1), nonlinear}); }
  BsdfId rough_plastic(MicrofacetType d, float alpha, bool visible = true) {
    return add(RoughPlastic{d, alpha, visible, 1.5f, color(0.1f, 0.4f, 0.7f), value(1), true});
  }
  /// A principled BSDF whose lobes are all left out; switch on what is wanted.
  Principled principled(float roughness) {
    return {.base_color = color(0.8f, 0.3f, 0.1f), .roughness = value(roughness)};
  }
  TextureId normal_map() { return color(0.62f, 0.41f, 0.93f); }

  Scene scene;
};

struct BsdfCase {
  std::string name;
  BsdfId id;
  float eta = 1;  ///< what refracts in it
};

/// Every model, both distributions, isotropic and not, and nested combinations.
inline std::vector<BsdfCase> all_bsdf_cases(BsdfBuilder& b) {
  std::vector<BsdfCase> cases;
  const auto add = [&](std::string name, BsdfId id, float eta = 1) { cases.push_back({std::move(name), id, eta}); };
  add("diffuse", b.diffuse());
  add("conductor", b.mirror());
  add("dielectric", b.dielectric(1.5f));
  add("thin_dielectric", b.add(ThinDielectric{1.5f, b.value(1), b.value(1)}));
  add("plastic", b.plastic());
  add("plastic nonlinear", b.plastic(true));
  add("null", b.add(Null{}));
  for (const auto d : {MicrofacetType::ggx, MicrofacetType::beckmann}) {
    for (const bool visible : {true, false}) {
      const std::string label = std::string(d == MicrofacetType::ggx ? " ggx" : " beckmann") + (visible ? "" : " all");
      add("rough_conductor" + label, b.rough_conductor(d, 0.3f, 0.3f, visible));
      add("rough_conductor anisotropic" + label, b.rough_conductor(d, 0.15f, 0.5f, visible));
      add("rough_dielectric" + label, b.rough_dielectric(d, 0.3f, 0.3f, 1.5f, visible), 1.5f);
      add("rough_dielectric anisotropic" + label, b.rough_dielectric(d, 0.2f, 0.5f, 1.33f, visible), 1.33f);
      add("rough_dielectric inverted" + label, b.rough_dielectric(d, 0.4f, 0.4f, 1 / 1.5f, visible), 1 / 1.5f);
      add("rough_plastic" + label, b.rough_plastic(d, 0.25f, visible));
    }
  }
  {
    Principled p = b.principled(0.5f);
    add("principled", b.add(p));
    p.metallic = b.value(0.7f);
    p.anisotropic = b.value(0.8f);
    add("principled metallic", b.add(p));
    p = b.principled(0.6f);
    p.spec_trans = b.value(0.8f);
    add("principled glass", b.add(p), p.eta);
    p.clearcoat = b.value(0.9f);
    p.clearcoat_gloss = b.value(0.1f);
    p.sheen = p.sheen_tint = p.flatness = p.spec_tint = b.value(0.5f);
    p.spec_trans = b.value(0.3f);
    p.diffuse_reflectance_sampling_rate = 0.7f;
    p.clearcoat_sampling_rate = 2;
    add("principled all", b.add(p), p.eta);
  }
  const auto ggx = MicrofacetType::ggx;
  const BsdfId glossy = b.rough_conductor(ggx, 0.3f, 0.3f), brushed = b.rough_conductor(ggx, 0.2f, 0.5f);
  const BsdfId diffuse = b.diffuse(), sided = b.add(TwoSided{diffuse, glossy});
  add("twosided pair", sided);
  add("twosided anisotropic", b.add(TwoSided{brushed, brushed}));
  add("mask", b.add(Mask{diffuse, b.value(0.3f)}));
  add("mask twosided", b.add(Mask{sided, b.value(0.6f)}));
  const BsdfId blend = b.add(BlendBsdf{diffuse, glossy, b.value(0.4f)});
  add("blend", blend);
  add("blend with mirror", b.add(BlendBsdf{diffuse, b.mirror(), b.value(0.4f)}));
  add("blend of blends", b.add(BlendBsdf{b.add(Mask{blend, b.value(0.7f)}), b.plastic(), b.value(0.3f)}));
  const auto map = [&](BsdfId nested) { return b.add(NormalMap{nested, b.normal_map(), true, true}); };
  add("normalmap", map(diffuse));
  add("normalmap anisotropic", map(brushed));
  add("normalmap of twosided", map(b.add(TwoSided{diffuse, diffuse})));
  add("twosided normalmap", b.add(TwoSided{map(b.rough_plastic(ggx, 0.3f)), diffuse}));
  add("normalmap glass", map(b.rough_dielectric(ggx, 0.4f, 0.4f, 1.5f)));
  Image bumps{4, 3, 1, false, std::vector<std::uint8_t>{10, 90, 200, 40, 150, 20, 80, 230, 60, 170, 120, 5}};
  const TextureId displacement =
      b.texture(BitmapTexture{.image = std::make_shared<const Image>(std::move(bumps)), .to_uv = {}});
  const BsdfId bumpy = b.add(BumpMap{brushed, displacement, 0.1f, true, true});
  add("bumpmap", bumpy);
  add("twosided bumpmap", b.add(TwoSided{bumpy, bumpy}));
  add("normalmap of normalmap", map(map(brushed)));
  add("blend of normalmaps", b.add(BlendBsdf{map(diffuse), map(map(glossy)), b.value(0.5f)}));
  return cases;
}

/// A point of the tests' surface, which stands askew in space.
inline SurfacePoint test_point(const Vec3& local_wi) {
  SurfacePoint p;
  p.ns = Vec3(0.3f, -0.5f, 0.6f).normalized();
  p.ng = Vec3(0.35f, -0.5f, 0.6f).normalized();
  p.dp_du = p.ns.cross(Vec3(0.1f, 0.9f, 0.2f)).normalized() * 2.0f;
  p.dp_dv = p.ns.cross(p.dp_du) * 1.5f;
  p.dn_du = p.dn_dv = Vec3(0.0f);
  p.uv = {0.3f, 0.7f};
  p.wi = frame_of_tangent(p.ns, p.dp_du, false).to_world(local_wi);
  return p;
}

}  // namespace warpath::test
