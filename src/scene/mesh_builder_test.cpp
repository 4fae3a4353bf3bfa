#include "scene/mesh_builder.h"

#include <gtest/gtest.h>

#include "scene/temporary_files.h"

namespace warpath {
namespace {

/// A pyramid with a seam in its texture coordinates at every edge.
constexpr std::string_view kPyramid =
    "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nv 1 0.5 1.5\nvt 0 0\nvt 1 0\nvt 1 0.25\nvt 0 0.25\n"
    "f 4/4 3/3 2/2 1/1\nf 1/1 2/2 5/3\nf 2/1 3/2 5/3\nf 3/1 4/2 5/3\nf 4/1 1/2 5/3\n";

IndexedMesh pyramid() {
  TemporaryFiles files;
  return read_obj(files.write("m.obj", kPyramid), true);
}

Vec3 geometric_normal(const Mesh& mesh, std::size_t triangle) {
  const auto* i = &mesh.indices[3 * triangle];
  return (mesh.positions[i[1]] - mesh.positions[i[0]]).cross(mesh.positions[i[2]] - mesh.positions[i[0]]).normalized();
}

void expect_near(const Vec3& a, const Vec3& b) { EXPECT_NEAR((a - b).length(), 0, 3e-6) << a << " against " << b; }

TEST(MeshBuilder, SmoothNormalsAsMitsuba) {
  MeshPlacement placement;
  Imath::M44d scale, rotate, translate;
  scale.setScale(Imath::V3d(2, -1, 0.5));
  rotate.setAxisAngle(Imath::V3d(0, 0, 1), M_PI / 6);
  translate.setTranslation(Imath::V3d(1, 2, 3));
  placement.to_world[0] = placement.to_world[1] = Matrix4(scale * rotate * translate);
  const Mesh mesh = build_mesh(pyramid(), placement);
  ASSERT_EQ(mesh.vertex_count(), 11u);
  ASSERT_EQ(mesh.triangle_count(), 6u);
  // What Mitsuba 3.9.1 has for this mesh under this transform.
  expect_near(mesh.positions[0], {1.5f, 1.1339746f, 3});
  expect_near(mesh.normals[0], {0, 0, 1});
  expect_near(mesh.positions[4], {2.982051f, 2.5669873f, 3.75f});
  expect_near(mesh.normals[2], {0.1275032f, -0.220842f, 0.9669393f});
  expect_near(mesh.normals[7], {-0.4160251f, 0.7205766f, -0.5547003f});
  EXPECT_EQ(mesh.uvs[0], Vec2(0, 0.75f));
}

TEST(MeshBuilder, FlippingTurnsTrianglesAndNormals) {
  MeshPlacement placement;
  const Mesh straight = build_mesh(pyramid(), placement);
  placement.flip_normals = true;
  const Mesh flipped = build_mesh(pyramid(), placement);
  EXPECT_FALSE(flipped.flip_normals);
  for (std::size_t v = 0; v < straight.vertex_count(); ++v) expect_near(flipped.normals[v], -straight.normals[v]);
  for (std::size_t t = 0; t < straight.triangle_count(); ++t)
    expect_near(geometric_normal(flipped, t), -geometric_normal(straight, t));
}

TEST(MeshBuilder, MirroredFileNormalsKeepTheirSide) {
  MeshPlacement placement;
  placement.to_world[0].setScale(Vec3(-1, 1, 1));
  placement.to_world[1] = placement.to_world[0];
  const Mesh cube = build_mesh(unit_cube(), placement);
  for (std::size_t t = 0; t < cube.triangle_count(); ++t) {
    const Vec3 centre = cube.positions[cube.indices[3 * t]] + cube.positions[cube.indices[3 * t + 1]];
    EXPECT_GT(geometric_normal(cube, t).dot(centre), 0);
    expect_near(cube.normals[cube.indices[3 * t]], geometric_normal(cube, t));
  }
  // Mitsuba 3.9.1: a triangle without normals of its own is turned by the mirror.
  IndexedMesh triangle;
  triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  triangle.corner_position = {0, 1, 2};
  const Mesh turned = build_mesh(std::move(triangle), placement);
  expect_near(geometric_normal(turned, 0), {0, 0, -1});
  expect_near(turned.normals[0], {0, 0, -1});
}

TEST(MeshBuilder, FaceNormalsDropTheFiles) {
  MeshPlacement placement;
  placement.face_normals = true;
  const Mesh cube = build_mesh(unit_cube(), placement);
  EXPECT_TRUE(cube.normals.empty());
  EXPECT_EQ(cube.uvs.size(), cube.vertex_count());
}

TEST(MeshBuilder, NormalsTakeTheInverseTranspose) {
  MeshPlacement placement;
  placement.to_world[0] = Matrix4(1, 0.5f, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1);  // shears: x moves y along
  placement.to_world[1] = placement.to_world[0];
  const Mesh cube = build_mesh(unit_cube(), placement);
  for (std::size_t t = 0; t < cube.triangle_count(); ++t)
    expect_near(cube.normals[cube.indices[3 * t]], geometric_normal(cube, t));
}

TEST(MeshBuilder, DegenerateTrianglesStayAndGiveNoNan) {
  IndexedMesh source;
  source.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}};
  source.normals = {{0, 0, 2}, {0, 0, 0}, {NAN, 0, 0}, {0, 0, 0}};  // the last three have to be made up
  source.corner_position = {0, 1, 2, 3, 3, 3};
  const Mesh mesh = build_mesh(std::move(source), {});
  EXPECT_EQ(mesh.triangle_count(), 2u);
  for (int v = 0; v < 3; ++v) expect_near(mesh.normals[static_cast<std::size_t>(v)], {0, 0, 1});
  expect_near(mesh.normals[3], {1, 0, 0});
}

TEST(MeshBuilder, TextureCoordinatesAreFinite) {
  IndexedMesh source;
  source.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  source.uvs = {{0, 0}, {NAN, 1}, {0.5f, 1}};
  source.corner_position = {0, 1, 2};
  const Mesh mesh = build_mesh(std::move(source), {});
  EXPECT_EQ(mesh.uvs, (std::vector<Vec2>{{0, 0}, {0, 0}, {0.5f, 1}}));
}

TEST(MeshBuilder, MotionHasTwoOfEach) {
  MeshPlacement placement;
  placement.moving = true;
  placement.to_world[1].setTranslation(Vec3(0, 0, 2));
  const Mesh mesh = build_mesh(unit_cube(), placement);
  ASSERT_EQ(mesh.positions_end.size(), mesh.positions.size());
  ASSERT_EQ(mesh.normals_end.size(), mesh.normals.size());
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
    expect_near(mesh.positions_end[v], mesh.positions[v] + Vec3(0, 0, 2));
}

TEST(MeshBuilder, UnreferencedVerticesAreDroppedAndOneIsKeptForEmbree) {
  IndexedMesh source;
  source.positions = {{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  source.corner_position = {1, 2, 3};
  const Mesh mesh = build_mesh(std::move(source), {});
  EXPECT_EQ(mesh.vertex_count(), 3u);
  EXPECT_EQ(mesh.positions.size(), 4u);
  EXPECT_EQ(mesh.positions[0], Vec3(0, 0, 0));
}

}  // namespace
}  // namespace warpath
