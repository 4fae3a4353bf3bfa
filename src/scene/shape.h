#pragma once
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "core/math.h"

namespace warpath {

// Wherever a shape has two placements they are those at the opening and the closing of the shutter, between which it
// moves linearly; keyframes at other times are already interpolated.

/// Triangles in world space. Vertex positions may have a second keyframe (linear motion of each vertex). Mirroring and
/// flipping are done: the triangles' orientation and the normals agree, and flip_normals stays false.
struct Mesh {
  std::vector<Vec3> positions;         ///< one more entry than vertices: Embree reads 16 bytes at each
  std::vector<Vec3> positions_end;     ///< the same when the shutter closes; empty if it stands still
  std::vector<Vec3> normals;           ///< per vertex, unit; empty means face normals
  std::vector<Vec3> normals_end;       ///< like positions_end
  std::vector<Vec2> uvs;               ///< per vertex; empty means (0,0), (1,0), (0,1) on every face, as in Mitsuba
  std::vector<std::uint32_t> indices;  ///< 3 per triangle
  bool flip_normals = false;
  std::size_t triangle_count() const { return indices.size() / 3; }
  std::size_t vertex_count() const { return positions.empty() ? 0 : positions.size() - 1; }
};
/// [-1,1]^2 in the local xy plane, normal +z; u, v run with x, y.
struct Rectangle {
  Matrix4 to_world[2];  ///< the same for what stands still
  bool flip_normals = false;
};
/// Unit disk in the local xy plane, normal +z; u is the radius, v the angle / 2 pi.
struct Disk {
  Matrix4 to_world[2];
  bool flip_normals = false;
};
/// flip_normals: they point inwards (a mirroring to_world is in it already).
struct Sphere {
  Vec3 center[2];
  float radius[2];
  Matrix4 to_world;  ///< for texture coordinates
  bool flip_normals = false;
};
/// Lateral surface, radius 1 around z from 0 to 1 before to_world, as Mitsuba builds it from p0, p1 and radius; its
/// normals point outwards, or inwards with flip_normals.
struct Cylinder {
  Matrix4 to_world[2];
  bool flip_normals = false;
};

struct Shape {
  std::string id;
  std::variant<Mesh, Rectangle, Disk, Sphere, Cylinder> geometry;
  std::int32_t bsdf = -1;     ///< index into Scene::bsdfs
  std::int32_t emitter = -1;  ///< index into Scene::emitters, of the area emitter on this shape
};

}  // namespace warpath
