#include <algorithm>
#include <cmath>

#include "core/log.h"
#include "scene/loader.h"
#include "scene/mesh_builder.h"

namespace warpath {
namespace {

using Geometry = decltype(Shape::geometry);

/// The image of a basis vector.
Vec3 axis(const Matrix4& m, int i) { return Vec3(m[i][0], m[i][1], m[i][2]); }

bool mirrors(const Matrix4& m) { return axis(m, 0).cross(axis(m, 1)).dot(axis(m, 2)) < 0; }

/// A singular matrix flattens the shape, and no normal can be told.
Motion get_placement(const LoadContext& context, const Object& object) {
  const Motion motion = get_motion(context, object, "to_world");
  for (const Matrix4& m : motion.matrix) {
    const Imath::M44d d(m);
    if (d.determinant() == 0)
      fail(object.has("to_world") ? object.find("to_world")->where : object.where, "to_world is singular");
  }
  return motion;
}

template <class Flat>
Geometry load_flat(LoadContext& context, const Object& object) {
  const Motion motion = get_placement(context, object);
  object.ignore({"face_normals"});  // they are flat
  Flat shape;
  shape.to_world[0] = motion.matrix[0];
  shape.to_world[1] = motion.matrix[1];
  shape.flip_normals = object.get_boolean("flip_normals", false);
  return shape;
}

Geometry load_sphere(LoadContext& context, const Object& object) {
  const Motion motion = get_placement(context, object);
  const Imath::V3d center = object.get_vector("center", Imath::V3d(0));
  const float radius = object.get_float("radius", 1);
  if (radius == 0) fail(object.find("radius")->where, "\"radius\" must not be 0");
  Imath::M44d local;
  local.setScale(static_cast<double>(radius));
  local[3][0] = center.x, local[3][1] = center.y, local[3][2] = center.z;
  Sphere sphere;
  for (int i = 0; i < 2; ++i) {
    const Matrix4 m = to_single(local * Imath::M44d(motion.matrix[i]));
    const float scales[3] = {axis(m, 0).length(), axis(m, 1).length(), axis(m, 2).length()};
    if (std::max({scales[0], scales[1], scales[2]}) > 1.001f * std::min({scales[0], scales[1], scales[2]}))
      log::warn("{}: to_world scales the sphere unevenly; its size along x is used, as in Mitsuba 3",
                to_string(object.where));
    sphere.center[i] = m.translation();
    sphere.radius[i] = scales[0];
    if (i == 0) sphere.to_world = m;
  }
  sphere.flip_normals = object.get_boolean("flip_normals", false) != mirrors(sphere.to_world);
  return sphere;
}

Geometry load_cylinder(LoadContext& context, const Object& object) {
  const Motion motion = get_placement(context, object);
  const Imath::V3d p0 = object.get_vector("p0", Imath::V3d(0)), p1 = object.get_vector("p1", Imath::V3d(0, 0, 1));
  const float radius = object.get_float("radius", 1);
  if (radius == 0) fail(object.find("radius")->where, "\"radius\" must not be 0");
  const double length = (p1 - p0).length();
  if (!(length > 0)) fail(object.where, "the cylinder has no length: p0 and p1 are the same");
  const Imath::V3d n = (p1 - p0) / length;
  const auto [s, t] = coordinate_system(n);
  const double r = radius;
  const Imath::M44d local(r * s.x, r * s.y, r * s.z, 0, r * t.x, r * t.y, r * t.z, 0, length * n.x, length * n.y,
                          length * n.z, 0, p0.x, p0.y, p0.z, 1);
  Cylinder cylinder;
  for (int i = 0; i < 2; ++i) cylinder.to_world[i] = to_single(local * Imath::M44d(motion.matrix[i]));
  cylinder.flip_normals = object.get_boolean("flip_normals", false);
  return cylinder;
}

MeshPlacement get_mesh_placement(LoadContext& context, const Object& object) {
  const Motion motion = get_placement(context, object);
  MeshPlacement placement;
  placement.to_world[0] = motion.matrix[0];
  placement.to_world[1] = motion.matrix[1];
  placement.moving = motion.moving;
  placement.flip_normals = object.get_boolean("flip_normals", false);
  placement.face_normals = object.get_boolean("face_normals", false);
  if (mirrors(motion.matrix[0]) != mirrors(motion.matrix[1]))
    fail(object.find("to_world")->where, "the animation turns the shape inside out");
  return placement;
}

Geometry load_cube(LoadContext& context, const Object& object) {
  return build_mesh(unit_cube(), get_mesh_placement(context, object));
}

/// Notes the reading of the file; the mesh arrives in the shape that will be the last one in a moment.
Geometry load_mesh_file(LoadContext& context, const Object& object) {
  const auto file = context.find(object, "filename");
  MeshPlacement placement = get_mesh_placement(context, object);
  const std::string& type = object.type;
  const bool flip_v = type != "serialized" && object.get_boolean("flip_tex_coords", type == "obj");
  const int shape_index = type == "serialized" ? static_cast<int>(object.get_integer("shape_index", 0, 0, 1 << 30)) : 0;
  const bool default_normals = !object.has("face_normals");
  Scene& scene = context.scene;
  const std::size_t index = scene.shapes.size();
  context.add_job(object.where, file, [=, &scene] {
    IndexedMesh source;
    MeshPlacement final_placement = placement;
    if (type == "obj") source = read_obj(file, flip_v);
    if (type == "ply") source = read_ply(file, flip_v);
    if (type == "serialized") {
      SerializedMesh serialized = read_serialized(file, shape_index);
      source = std::move(serialized.mesh);
      if (default_normals) final_placement.face_normals = serialized.face_normals;
    }
    if (source.corner_position.empty()) throw MeshError(fmt::format("{}: the mesh has no triangles", file.string()));
    scene.shapes[index].geometry = build_mesh(std::move(source), final_placement);
  });
  return Mesh{};
}

struct Plugin {
  std::string_view name;
  Geometry (*load)(LoadContext&, const Object&);
};
constexpr Plugin kPlugins[] = {{"obj", load_mesh_file},        {"ply", load_mesh_file},
                               {"serialized", load_mesh_file}, {"rectangle", load_flat<Rectangle>},
                               {"disk", load_flat<Disk>},      {"cube", load_cube},
                               {"sphere", load_sphere},        {"cylinder", load_cylinder}};

/// Grey 0.5, or black for a shape that shines.
BsdfId default_bsdf(LoadContext& context, bool shines) {
  const TextureId grey = context.add_texture(ConstantTexture{Color(shines ? 0.0f : 0.5f)});
  return context.add_bsdf({"", Diffuse{grey}});
}

}  // namespace

void load_shape(LoadContext& context, const Object& object) {
  Shape shape;
  shape.id = object.id;
  shape.geometry = find_plugin(kPlugins, object).load(context, object);
  object.ignore({"silhouette_sampling_weight"});  // for Mitsuba's derivatives

  const auto only = [&](std::string_view tag) -> const Object* {
    const auto found = object.take_objects(tag);
    if (found.size() > 1)
      fail(found[1]->where, "a second {} in one shape; the first is at {}", tag, to_string(found[0]->where));
    return found.empty() ? nullptr : std::get<const Object*>(found[0]->value);
  };
  if (const Object* emitter = only("emitter"))
    shape.emitter = load_area_emitter(context, *emitter, static_cast<std::int32_t>(context.scene.shapes.size()));
  const Object* bsdf = only("bsdf");
  shape.bsdf = bsdf ? load_bsdf(context, *bsdf) : default_bsdf(context, shape.emitter >= 0);
  object.check_all_read();
  context.scene.shapes.push_back(std::move(shape));
}

}  // namespace warpath
