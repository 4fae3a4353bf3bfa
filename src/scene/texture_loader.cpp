#include <algorithm>
#include <cmath>

#include "scene/loader.h"

namespace warpath {
namespace {

/// The plane's part of a 4 x 4 matrix, as Mitsuba cuts it out for `to_uv`.
Imath::M33f get_uv_transform(const Object& object) {
  const Imath::M44d m = get_still_transform(object, "to_uv");
  const auto f = [](double x) { return static_cast<float>(x); };
  return Imath::M33f(f(m[0][0]), f(m[0][1]), 0, f(m[1][0]), f(m[1][1]), 0, f(m[3][0]), f(m[3][1]), 1);
}

Texture load_bitmap(LoadContext& context, const Object& object) {
  object.ignore({"format", "accel"});  // how Mitsuba stores it
  BitmapTexture bitmap;
  bitmap.to_uv = get_uv_transform(object);
  bitmap.filter = object.get_choice("filter_type", "bilinear", {"nearest", "bilinear"}) == "nearest"
                      ? BitmapTexture::Filter::nearest
                      : BitmapTexture::Filter::bilinear;
  const std::string wrap = object.get_choice("wrap_mode", "repeat", {"repeat", "mirror", "clamp"});
  bitmap.wrap = wrap == "repeat"   ? BitmapTexture::Wrap::repeat
                : wrap == "mirror" ? BitmapTexture::Wrap::mirror
                                   : BitmapTexture::Wrap::clamp;
  const bool raw = object.get_boolean("raw", false);
  const auto file = context.find(object, "filename");
  bitmap.image = context.texture_image(object.find("filename")->where, file, raw);
  return bitmap;
}

Texture load_checkerboard(LoadContext& context, const Object& object, ColorRole role) {
  CheckerboardTexture checkerboard;
  checkerboard.color0 = get_color(context, object, "color0", 0.4f, role);
  checkerboard.color1 = get_color(context, object, "color1", 0.2f, role);
  checkerboard.to_uv = get_uv_transform(object);
  return checkerboard;
}

Color checked(const Color& color, ColorRole role, const Location& where) {
  if (role == ColorRole::reflectance)
    for (int i = 0; i < 3; ++i)
      if (color[i] < 0 || color[i] > 1)
        fail(where, "the reflectance ({}, {}, {}) is not between 0 and 1", color.x, color.y, color.z);
  return color;
}

SpectrumValue get_spectrum(const Object& object) {
  const Property* property = object.take("value");
  if (!property) fail(object.where, "a \"{}\" spectrum needs a \"value\"", object.type);
  const auto* spectrum = std::get_if<SpectrumValue>(&property->value);
  if (!spectrum) fail(property->where, "\"value\" must be a <spectrum>, not {}", describe_type(property->value));
  return *spectrum;
}

/// <spectrum type="..."> that is one colour.
Color load_spectrum(LoadContext& context, const Object& object, ColorRole role) {
  if (object.type == "uniform") {
    object.ignore({"wavelength_min", "wavelength_max"});
    return Color(object.require_float("value"));
  }
  if (object.type == "srgb") {
    const bool unbounded = object.get_boolean("unbounded", false) || role != ColorRole::reflectance;
    if (!object.has("color")) fail(object.where, "an \"srgb\" spectrum needs an <rgb name=\"color\">");
    return get_color(context, object, "color", 0, unbounded ? ColorRole::unbounded : role);
  }
  if (object.type == "d65") {  // white in RGB, times what is in it
    const float scale = object.get_float("scale", 1);
    return object.has("color") ? get_color(context, object, "color", 1, ColorRole::unbounded) * scale : Color(scale);
  }
  return spectrum_to_rgb(get_spectrum(object), role, object.where);  // regular, irregular
}

TextureId load_uncached(LoadContext& context, const Object& object, ColorRole role) {
  constexpr std::string_view kKnown[] = {"bitmap", "checkerboard", "uniform", "srgb", "d65", "regular", "irregular"};
  TextureId id = -1;
  if (object.type == "bitmap") {
    id = context.add_texture(load_bitmap(context, object));
  } else if (object.type == "checkerboard") {
    id = context.add_texture(load_checkerboard(context, object, role));
  } else if (const auto nested = object.take_objects("texture"); object.type == "d65" && !nested.empty()) {
    if (nested.size() > 1) fail(nested[1]->where, "a \"d65\" spectrum holds one texture at most");
    object.ignore({"scale"});  // Mitsuba's RGB variants do
    id = load_texture(context, *std::get<const Object*>(nested[0]->value), role);
  } else if (std::find(std::begin(kKnown), std::end(kKnown), object.type) != std::end(kKnown)) {
    id = context.add_texture(ConstantTexture{load_spectrum(context, object, role)});
  } else if (object.type == "blackbody") {
    fail(object.where, "the spectrum \"blackbody\" needs a spectral renderer; warpath renders RGB: use an <rgb>");
  } else {
    fail(object.where, "unknown texture \"{}\";{}", object.type, suggestion(object.type, kKnown));
  }
  object.check_all_read();
  return id;
}

}  // namespace

TextureId load_texture(LoadContext& context, const Object& object, ColorRole role) {
  if (object.tag != "texture") fail(object.where, "expected a texture, not a {}", object.tag);
  const auto known = context.textures.find(&object);
  if (known != context.textures.end()) return known->second;
  return context.textures[&object] = load_uncached(context, object, role);
}

TextureId get_texture(LoadContext& context, const Object& object, std::string_view name, float missing,
                      ColorRole role) {
  if (const Property* property = object.find(name))
    if (const auto* nested = std::get_if<const Object*>(&property->value)) {
      property->read = true;
      return load_texture(context, **nested, role);
    }
  return context.add_texture(ConstantTexture{get_color(context, object, name, missing, role)});
}

Color get_color(LoadContext& context, const Object& object, std::string_view name, float missing, ColorRole role) {
  const Property* property = object.take(name);
  if (!property) return Color(missing);
  if (const auto* nested = std::get_if<const Object*>(&property->value)) {
    const TextureId id = load_texture(context, **nested, role);
    if (const auto* constant = std::get_if<ConstantTexture>(&context.scene.textures[static_cast<std::size_t>(id)]))
      return constant->value;
    fail(property->where, "\"{}\" of {} \"{}\" must be one colour, not a {} texture", name, object.tag, object.type,
         (*nested)->type);
  }
  if (const auto* rgb = std::get_if<RgbValue>(&property->value)) return checked(rgb->color, role, property->where);
  if (const auto* spectrum = std::get_if<SpectrumValue>(&property->value))
    return spectrum_to_rgb(*spectrum, role, property->where);
  return Color(object.get_float(name, missing));
}

}  // namespace warpath
