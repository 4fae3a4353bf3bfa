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

/// A mesh in world space as Mitsuba 3 builds it: corners with the same position, normal and texture coordinates share
/// a vertex; a mirroring transform or flip_normals (not both) reverses the triangles, and flip_normals negates the
/// file's normals, so that Mesh::flip_normals stays false. Where the file has no normals they are computed per
/// position, each triangle's weighted by its angle (Thuermer and Wuethrich, JGT 3(1), 1998), unless face_normals is
/// set.
Mesh build_mesh(IndexedMesh&& source, const MeshPlacement& placement);

/// The cube [-1,1]^3 with texture coordinates and normals per side, as Mitsuba's.
IndexedMesh unit_cube();

}  // namespace warpath
