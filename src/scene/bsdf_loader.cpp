#include <cmath>

#include "scene/loader.h"

namespace warpath {
namespace {

using Model = decltype(Bsdf::model);

TextureId reflectance(LoadContext& context, const Object& object, std::string_view name, float missing = 1) {
  return get_texture(context, object, name, missing, ColorRole::reflectance);
}

MicrofacetType get_distribution(const Object& object) {
  return object.get_choice("distribution", "beckmann", {"beckmann", "ggx"}) == "ggx" ? MicrofacetType::ggx
                                                                                     : MicrofacetType::beckmann;
}

void get_alpha(LoadContext& context, const Object& object, TextureId& alpha_u, TextureId& alpha_v) {
  const bool u = object.has("alpha_u"), v = object.has("alpha_v");
  if (!u && !v) {
    alpha_u = alpha_v = get_texture(context, object, "alpha", 0.1f, ColorRole::unbounded);
  } else {
    const Property* given = object.find(u ? "alpha_u" : "alpha_v");
    if (u != v) fail(given->where, "\"alpha_u\" and \"alpha_v\" must be given together");
    if (object.has("alpha")) fail(object.find("alpha")->where, "give either \"alpha\" or \"alpha_u\" and \"alpha_v\"");
    alpha_u = get_texture(context, object, "alpha_u", 0.1f, ColorRole::unbounded);
    alpha_v = get_texture(context, object, "alpha_v", 0.1f, ColorRole::unbounded);
  }
  for (const TextureId id : {alpha_u, alpha_v}) {
    const auto* constant = std::get_if<ConstantTexture>(&context.scene.textures[static_cast<std::size_t>(id)]);
    if (constant && constant->value.x < 0) fail(object.where, "the roughness alpha is negative: {}", constant->value.x);
  }
}

float relative_ior(const Object& object, std::string_view inside) {
  return get_ior(object, "int_ior", inside) / get_ior(object, "ext_ior", "air");
}

/// (eta, k) or a metal's name; without either, the perfect mirror.
void get_conductor_ior(LoadContext& context, const Object& object, Color& eta, Color& k) {
  const std::string material = object.get_string("material", "none");
  if (object.has("eta") || material == "none") {
    if (material != "none")
      fail(object.find("material")->where, "give either a \"material\" or \"eta\" and \"k\", not both");
    eta = get_color(context, object, "eta", 0, ColorRole::unbounded);
    k = get_color(context, object, "k", 1, ColorRole::unbounded);
    return;
  }
  if (object.has("k")) fail(object.find("k")->where, "give either a \"material\" or \"eta\" and \"k\", not both");
  const Metal* metal = find_metal(material);
  if (!metal)
    fail(object.find("material")->where, "unknown material \"{}\";{}", material, suggestion(material, metal_names()));
  eta = Color(metal->eta[0], metal->eta[1], metal->eta[2]);
  k = Color(metal->k[0], metal->k[1], metal->k[2]);
}

std::vector<BsdfId> load_nested(LoadContext& context, const Object& object, std::size_t least, std::size_t most) {
  const auto nested = object.take_objects("bsdf");
  const std::string wanted = least == most ? fmt::format("{}", least) : fmt::format("{} or {}", least, most);
  if (nested.size() > most)
    fail(nested[most]->where, "\"{}\" holds {} BSDF{}, not {}", object.type, wanted, most > 1 ? "s" : "",
         nested.size());
  if (nested.size() < least)
    fail(object.where, "\"{}\" needs {} BSDF{} in it, it has {}", object.type, wanted, most > 1 ? "s" : "",
         nested.size());
  std::vector<BsdfId> result;
  for (const Property* property : nested)
    result.push_back(load_bsdf(context, *std::get<const Object*>(property->value)));
  return result;
}

bool transmits(const Scene& scene, BsdfId id) {
  return std::visit(
      [&](const auto& b) {
        if constexpr (requires { b.transmits(); }) return b.transmits();
        if constexpr (requires { b.nested; }) return transmits(scene, b.nested);
        if constexpr (requires { b.first; }) return transmits(scene, b.first) || transmits(scene, b.second);
        return false;
      },
      scene.bsdfs[static_cast<std::size_t>(id)].model);
}

Model load_diffuse(LoadContext& context, const Object& object) {
  return Diffuse{reflectance(context, object, "reflectance", 0.5f)};
}

Model load_conductor(LoadContext& context, const Object& object) {
  Conductor b;
  get_conductor_ior(context, object, b.eta, b.k);
  b.specular_reflectance = reflectance(context, object, "specular_reflectance");
  return b;
}

Model load_roughconductor(LoadContext& context, const Object& object) {
  RoughConductor b;
  b.distribution = get_distribution(object);
  get_alpha(context, object, b.alpha_u, b.alpha_v);
  b.sample_visible = object.get_boolean("sample_visible", true);
  get_conductor_ior(context, object, b.eta, b.k);
  b.specular_reflectance = reflectance(context, object, "specular_reflectance");
  return b;
}

template <class Smooth>
Model load_smooth_dielectric(LoadContext& context, const Object& object) {
  Smooth b;
  b.eta = relative_ior(object, "bk7");
  b.specular_reflectance = reflectance(context, object, "specular_reflectance");
  b.specular_transmittance = reflectance(context, object, "specular_transmittance");
  return b;
}

Model load_roughdielectric(LoadContext& context, const Object& object) {
  RoughDielectric b;
  b.distribution = get_distribution(object);
  get_alpha(context, object, b.alpha_u, b.alpha_v);
  b.sample_visible = object.get_boolean("sample_visible", true);
  b.eta = relative_ior(object, "bk7");
  b.specular_reflectance = reflectance(context, object, "specular_reflectance");
  b.specular_transmittance = reflectance(context, object, "specular_transmittance");
  return b;
}

Model load_plastic(LoadContext& context, const Object& object) {
  Plastic b;
  b.eta = relative_ior(object, "polypropylene");
  b.diffuse_reflectance = reflectance(context, object, "diffuse_reflectance", 0.5f);
  b.specular_reflectance = reflectance(context, object, "specular_reflectance");
  b.nonlinear = object.get_boolean("nonlinear", false);
  return b;
}

Model load_roughplastic(LoadContext& context, const Object& object) {
  RoughPlastic b;
  b.distribution = get_distribution(object);
  b.alpha = object.get_float("alpha", 0.1f);
  if (b.alpha < 0) fail(object.find("alpha")->where, "the roughness alpha is negative: {}", b.alpha);
  if (object.has("alpha_u") || object.has("alpha_v"))
    fail(object.find(object.has("alpha_u") ? "alpha_u" : "alpha_v")->where,
         "\"roughplastic\" cannot be anisotropic; use \"alpha\"");
  b.sample_visible = object.get_boolean("sample_visible", true);
  b.eta = relative_ior(object, "polypropylene");
  b.diffuse_reflectance = reflectance(context, object, "diffuse_reflectance", 0.5f);
  b.specular_reflectance = reflectance(context, object, "specular_reflectance");
  b.nonlinear = object.get_boolean("nonlinear", false);
  return b;
}

Model load_principled(LoadContext& context, const Object& object) {
  Principled b;
  const auto lobe = [&](std::string_view name) {
    const TextureId texture = reflectance(context, object, name, 0);
    const Property* property = object.find(name);
    if (!property) return -1;
    const auto* value = std::get_if<double>(&property->value);
    return value && *value == 0 ? -1 : texture;
  };
  b.base_color = reflectance(context, object, "base_color", 0.5f);
  b.roughness = reflectance(context, object, "roughness", 0.5f);
  b.anisotropic = lobe("anisotropic");
  b.metallic = lobe("metallic");
  b.spec_trans = lobe("spec_trans");
  b.spec_tint = lobe("spec_tint");
  b.sheen = lobe("sheen");
  b.sheen_tint = lobe("sheen_tint");
  b.flatness = lobe("flatness");
  b.clearcoat = lobe("clearcoat");
  b.clearcoat_gloss = reflectance(context, object, "clearcoat_gloss", 0);
  b.main_specular_sampling_rate = object.get_float("main_specular_sampling_rate", 1);
  b.clearcoat_sampling_rate = object.get_float("clearcoat_sampling_rate", 1);
  b.diffuse_reflectance_sampling_rate = object.get_float("diffuse_reflectance_sampling_rate", 1);

  if (object.has("eta")) {
    if (object.has("specular")) fail(object.find("specular")->where, "give either \"eta\" or \"specular\", not both");
    b.eta = object.get_float("eta", 1.5f);
    if (b.transmits() && b.eta == 1) b.eta = 1.001f;  // as Mitsuba: nothing would refract
  } else {
    float specular = object.get_float("specular", 0.5f);
    if (b.transmits() && specular == 0) specular = 1e-3f;
    b.eta = 2 / (1 - std::sqrt(0.08f * specular)) - 1;
  }
  if (!(b.eta > 0)) fail(object.where, "the index of refraction must be greater than 0, not {}", b.eta);
  return b;
}

Model load_twosided(LoadContext& context, const Object& object) {
  const auto nested = load_nested(context, object, 1, 2);
  const bool allowed = object.get_boolean("allow_transmission", false);
  for (const BsdfId id : nested)
    if (transmits(context.scene, id)) {
      if (allowed) fail(object.find("allow_transmission")->where, "\"allow_transmission\" is not supported yet");
      fail(object.where,
           "\"twosided\" holds only BSDFs that let no light through (put \"mask\" around it, not into it)");
    }
  return TwoSided{nested.front(), nested.back()};
}

Model load_mask(LoadContext& context, const Object& object) {
  const BsdfId nested = load_nested(context, object, 1, 1)[0];
  return Mask{nested, reflectance(context, object, "opacity", 0.5f)};
}

Model load_blendbsdf(LoadContext& context, const Object& object) {
  const auto nested = load_nested(context, object, 2, 2);
  if (!object.has("weight")) fail(object.where, "\"blendbsdf\" needs a \"weight\"");
  return BlendBsdf{nested[0], nested[1], reflectance(context, object, "weight")};
}

/// How Mitsuba mends normals that face away from the ray, and the shadows that they make.
template <class Map>
void load_normal_mending(const Object& object, Map& map) {
  map.flip_invalid_normals = object.get_boolean("flip_invalid_normals", true);
  map.use_shadowing_function = object.get_boolean("use_shadowing_function", true);
}

Model load_bumpmap(LoadContext& context, const Object& object) {
  const BsdfId nested = load_nested(context, object, 1, 1)[0];
  const auto textures = object.take_objects("texture");
  if (textures.size() != 1) fail(object.where, "\"bumpmap\" needs one texture in it, it has {}", textures.size());
  BumpMap b{nested, load_texture(context, *std::get<const Object*>(textures[0]->value), ColorRole::unbounded)};
  b.scale = object.get_float("scale", 1);
  load_normal_mending(object, b);
  return b;
}

Model load_normalmap(LoadContext& context, const Object& object) {
  const BsdfId nested = load_nested(context, object, 1, 1)[0];
  if (!object.has("normalmap")) fail(object.where, "\"normalmap\" needs a <texture name=\"normalmap\">");
  NormalMap b{nested, get_texture(context, object, "normalmap", 0, ColorRole::unbounded)};
  load_normal_mending(object, b);
  return b;
}

Model load_null(LoadContext&, const Object&) { return Null{}; }

struct Plugin {
  std::string_view name;
  Model (*load)(LoadContext&, const Object&);
};
constexpr Plugin kPlugins[] = {{"diffuse", load_diffuse},
                               {"conductor", load_conductor},
                               {"roughconductor", load_roughconductor},
                               {"dielectric", load_smooth_dielectric<Dielectric>},
                               {"roughdielectric", load_roughdielectric},
                               {"thindielectric", load_smooth_dielectric<ThinDielectric>},
                               {"plastic", load_plastic},
                               {"roughplastic", load_roughplastic},
                               {"principled", load_principled},
                               {"twosided", load_twosided},
                               {"mask", load_mask},
                               {"blendbsdf", load_blendbsdf},
                               {"bumpmap", load_bumpmap},
                               {"normalmap", load_normalmap},
                               {"null", load_null}};

}  // namespace

BsdfId load_bsdf(LoadContext& context, const Object& object) {
  if (const auto known = context.bsdfs.find(&object); known != context.bsdfs.end()) return known->second;
  Model model = find_plugin(kPlugins, object).load(context, object);
  object.check_all_read();
  return context.bsdfs[&object] = context.add_bsdf({object.id, std::move(model)});
}

}  // namespace warpath
