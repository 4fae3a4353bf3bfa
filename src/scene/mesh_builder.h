#pragma once
#include "scene/mesh_file.h"
#include "scene/shape.h"

namespace warpath {

struct MeshPlacement {
  Matrix4 to_world[2];  ///< at the opening and the closing of the shutter
  bool moving = false;
  bool flip_normals = false;
  bool face_normals = false;
};

/// A mesh in world space as Mitsuba 3.9 builds it: corners with the same indices share a vertex. Where the file has no
/// normals they are computed per vertex, each triangle's weighted by its angle (Thuermer and Wuethrich, JGT 3(1),
/// 1998), unless face_normals is set. flip_normals reverses the triangles and negates the normals, so that
/// Mesh::flip_normals stays false. Under a mirroring transform normals of the file keep their side and the triangles
/// follow them; without such normals the order of the corners alone says which side is in front, and the mirror turns
/// it.
Mesh build_mesh(IndexedMesh&& source, const MeshPlacement& placement);

/// The cube [-1,1]^3 with texture coordinates and normals per side, as Mitsuba's.
IndexedMesh unit_cube();

}  // namespace warpath
