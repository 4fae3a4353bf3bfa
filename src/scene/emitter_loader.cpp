#include <cmath>

#include "scene/loader.h"

namespace warpath {
namespace {

using Model = decltype(Emitter::model);

Color get_power(LoadContext& context, const Object& object, std::string_view name) {
  const Color color = get_color(context, object, name, 1, ColorRole::emission);
  for (int i = 0; i < 3; ++i)
    if (!(color[i] >= 0)) fail(object.find(name)->where, "\"{}\" must not be negative", name);
  return color;
}

void refuse_both(const Object& object, std::string_view name) {
  if (object.has(name) && object.has("to_world"))
    fail(object.find("to_world")->where, "give either \"{}\" or \"to_world\", not both", name);
}

void refuse_second_environment(const LoadContext& context, const Object& object) {
  for (const Emitter& other : context.scene.emitters)
    if (std::holds_alternative<EnvmapEmitter>(other.model) || std::holds_alternative<ConstantEmitter>(other.model))
      fail(object.where, "a scene has one \"envmap\" or \"constant\" emitter at most");
}

Model load_envmap(LoadContext& context, const Object& object) {
  refuse_second_environment(context, object);
  object.ignore({"mis_compensation"});  // how Mitsuba samples it
  EnvmapEmitter e;
  const auto file = context.find(object, "filename");
  e.image = context.environment_image(object.find("filename")->where, file);
  e.scale = object.get_float("scale", 1);
  if (e.scale < 0) fail(object.find("scale")->where, "\"scale\" must not be negative");
  e.to_world = to_single(get_still_transform(object, "to_world"));
  return e;
}

Model load_constant(LoadContext& context, const Object& object) {
  refuse_second_environment(context, object);
  object.ignore({"to_world"});
  return ConstantEmitter{get_power(context, object, "radiance")};
}

Model load_point(LoadContext& context, const Object& object) {
  refuse_both(object, "position");
  const Imath::M44d to_world = get_still_transform(object, "to_world");
  return PointEmitter{Vec3(object.get_vector("position", to_world.translation())),
                      get_power(context, object, "intensity")};
}

Model load_spot(LoadContext& context, const Object& object) {
  SpotEmitter e;
  e.to_world = to_single(get_still_transform(object, "to_world"));
  e.intensity = get_power(context, object, "intensity");
  if (object.has("texture")) {
    e.texture = get_texture(context, object, "texture", 1, ColorRole::unbounded);
    if (std::holds_alternative<ConstantTexture>(context.scene.textures[static_cast<std::size_t>(e.texture)]))
      fail(object.find("texture")->where, "\"texture\" of a spot must vary; put a constant into \"intensity\"");
  }
  e.cutoff_angle = object.get_float("cutoff_angle", 20);
  e.beam_width = object.get_float("beam_width", e.cutoff_angle * 3 / 4);
  if (!(e.cutoff_angle > 0 && e.cutoff_angle < 180))
    fail(object.where, "\"cutoff_angle\" must be between 0 and 180 degrees, not {}", e.cutoff_angle);
  if (!(e.beam_width >= 0 && e.beam_width <= e.cutoff_angle))
    fail(object.where, "\"beam_width\" must be from 0 to the cutoff angle ({}), not {}", e.cutoff_angle, e.beam_width);
  return e;
}

Model load_directional(LoadContext& context, const Object& object) {
  refuse_both(object, "direction");
  const Imath::M44d to_world = get_still_transform(object, "to_world");
  Imath::V3d direction;
  to_world.multDirMatrix(Imath::V3d(0, 0, 1), direction);
  direction = object.get_vector("direction", direction);
  if (!(direction.length() > 0)) fail(object.where, "the direction of the light has no length");
  return DirectionalEmitter{Vec3(direction.normalized()), get_power(context, object, "irradiance")};
}

struct Plugin {
  std::string_view name;
  Model (*load)(LoadContext&, const Object&);
};
constexpr Plugin kPlugins[] = {{"area", nullptr},  // by its shape: load_area_emitter
                               {"envmap", load_envmap}, {"constant", load_constant},      {"point", load_point},
                               {"spot", load_spot},     {"directional", load_directional}};

float get_sampling_weight(const Object& object) {
  const float weight = object.get_float("sampling_weight", 1);
  if (weight < 0) fail(object.find("sampling_weight")->where, "\"sampling_weight\" must not be negative");
  return weight;
}

}  // namespace

void load_emitter(LoadContext& context, const Object& object) {
  const Plugin& plugin = find_plugin(kPlugins, object);
  Emitter emitter{object.id, get_sampling_weight(object), plugin.load(context, object)};
  object.check_all_read();
  context.scene.emitters.push_back(std::move(emitter));
}

std::int32_t load_area_emitter(LoadContext& context, const Object& object, std::int32_t shape) {
  if (object.type != "area") {
    find_plugin(kPlugins, object);
    fail(object.where, "a \"{}\" emitter cannot stand in a shape; put it into the scene, or use \"area\"", object.type);
  }
  if (object.has("to_world"))
    fail(object.find("to_world")->where, "an area emitter is where its shape is: no \"to_world\"");
  const float weight = get_sampling_weight(object);
  const TextureId radiance = get_texture(context, object, "radiance", 1, ColorRole::emission);
  if (const auto* constant = std::get_if<ConstantTexture>(&context.scene.textures[static_cast<std::size_t>(radiance)]))
    if (!(constant->value.x >= 0 && constant->value.y >= 0 && constant->value.z >= 0))
      fail(object.find("radiance")->where, "\"radiance\" must not be negative");
  object.check_all_read();
  context.attached_emitters.insert(&object);
  context.scene.emitters.push_back({object.id, weight, AreaEmitter{shape, radiance}});
  return static_cast<std::int32_t>(context.scene.emitters.size() - 1);
}

}  // namespace warpath
