#include "tracer/embree_scene.h"

#include <gtest/gtest.h>

#include "tracer/sampling.h"
#include "tracer/surface.h"
#include "tracer/test_scene.h"
#include "tracer/workspace.h"

namespace warpath {
namespace {

using testing::make_rectangle;
using testing::make_sphere;
using testing::SceneBuilder;
using testing::translate;

struct Traced {
  explicit Traced(const Scene& s)
      : scene(s), materials(scene), surfaces(scene.shapes, materials), embree(scene.shapes, surfaces.analytic()) {}
  const Scene& scene;
  Materials materials;
  Surfaces surfaces;
  EmbreeScene embree;
};

TEST(EmbreeScene, TriangleNormalFollowsItsWindingAndBarycentricsTheirVertices) {
  SceneBuilder b;
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 0}};
  mesh.uvs = {{0, 0}, {1, 0}, {0, 1}};
  mesh.indices = {0, 1, 2};
  Mesh flipped = mesh;
  flipped.flip_normals = true;
  for (auto& p : flipped.positions) p.z = -1;
  const BsdfId bsdf = b.diffuse(Color(0.5f));
  b.light(mesh, Color(1.0f));  // texture coordinates are only computed where something needs them
  b.light(flipped, Color(1.0f));
  (void)bsdf;
  const Traced t(b.scene);
  Workspace w;
  w.resize(2);
  w.rays.set(0, {0.5f, 0.25f, 3}, {0, 0, -1}, 1e9f, 0);
  w.rays.set(1, {0.5f, 0.25f, -3}, {0, 0, 1}, 1e9f, 0);
  t.embree.intersect(w.rays, 2, w.hits, false);
  ASSERT_EQ(w.hits.shape[0], 0u);
  ASSERT_EQ(w.hits.shape[1], 1u);
  EXPECT_FLOAT_EQ(w.hits.t[0], 3);
  SurfacePoint point;
  const Vec3 p = t.surfaces.at(w.hits, 0, w.rays, point);
  EXPECT_NEAR((p - Vec3(0.5f, 0.25f, 0)).length(), 0, 1e-6f);
  EXPECT_NEAR((point.ng - Vec3(0, 0, 1)).length(), 0, 1e-6f);
  EXPECT_NEAR((point.uv - Vec2(0.25f, 0.125f)).length(), 0, 1e-6f);
  t.surfaces.at(w.hits, 1, w.rays, point);
  EXPECT_NEAR((point.ng - Vec3(0, 0, -1)).length(), 0, 1e-6f);
  EXPECT_NEAR((point.ns - Vec3(0, 0, -1)).length(), 0, 1e-6f);
}

TEST(EmbreeScene, StreamsOfAnyLengthAgreeWithEveryShapeTestedAlone) {
  SceneBuilder b;
  const BsdfId bsdf = b.diffuse(Color(0.5f));
  std::vector<AnalyticShape> spheres;
  for (int i = 0; i < 20; ++i) {
    const std::uint64_t key = sample_key(1, static_cast<std::uint64_t>(i));
    const auto coordinate = [&](std::uint32_t d) { return 6 * sample_float(key, d) - 3; };
    const Sphere s = make_sphere({coordinate(0), coordinate(1), coordinate(2)}, 0.2f + sample_float(key, 3));
    b.shape(s, bsdf);
    spheres.emplace_back(s);
  }
  const Traced t(b.scene);
  const std::size_t most = 67;
  Workspace w;
  w.resize(most);
  for (const std::size_t n :
       {std::size_t{0}, std::size_t{1}, std::size_t{15}, std::size_t{16}, std::size_t{17}, most}) {
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint64_t key = sample_key(2, i);
      w.rays.set(i, Vec3(0), sample_sphere({sample_float(key, 0), sample_float(key, 1)}), 1e9f, 0);
    }
    t.embree.intersect(w.rays, n, w.hits, false);
    t.embree.occluded(w.rays, n, w.shadowed);
    for (std::size_t i = 0; i < n; ++i) {
      float nearest = 1e9f;
      for (const auto& sphere : spheres) sphere.intersect(Vec3(0), w.rays.direction(i), 0, 0, nearest, nearest);
      EXPECT_EQ(w.hits.shape[i] != kNoHit, nearest < 1e9f);
      EXPECT_EQ(w.shadowed[i] != 0, nearest < 1e9f);
      if (nearest < 1e9f) {
        EXPECT_FLOAT_EQ(w.hits.t[i], nearest);
      }
    }
  }
}

TEST(EmbreeScene, RectangleCoordinatesRunWithItsAxesOverBothTriangles) {
  SceneBuilder b;
  b.light(make_rectangle(translate({0, 0, -2})), Color(1.0f));
  const Traced t(b.scene);
  Workspace w;
  w.resize(64);
  for (std::size_t i = 0; i < 64; ++i)
    w.rays.set(i, {2 * (i % 8 + 0.5f) / 8 - 1, 2 * (i / 8 + 0.5f) / 8 - 1, 0}, {0, 0, -1}, 1e9f, 0);
  t.embree.intersect(w.rays, 64, w.hits, true);
  for (std::size_t i = 0; i < 64; ++i) {
    ASSERT_EQ(w.hits.shape[i], 0u);
    SurfacePoint point;
    t.surfaces.at(w.hits, i, w.rays, point);
    EXPECT_NEAR((point.uv - Vec2((i % 8 + 0.5f) / 8, (i / 8 + 0.5f) / 8)).length(), 0, 1e-6f);
    EXPECT_NEAR((point.ns - Vec3(0, 0, 1)).length(), 0, 1e-6f);
  }
}

TEST(EmbreeScene, MovingShapesAreWhereTheirTimeSays) {
  SceneBuilder b;
  const BsdfId bsdf = b.diffuse(Color(0.5f));
  Mesh mesh = SceneBuilder::grid(1, translate({-4, 0, 0}));
  mesh.positions_end = SceneBuilder::grid(1, translate({4, 0, 0})).positions;
  b.shape(mesh, bsdf);
  b.shape(Rectangle{{translate({-4, 10, 0}), translate({4, 10, 0})}, false}, bsdf);
  Sphere sphere = make_sphere({-4, 20, 0}, 1);
  sphere.center[1] = {4, 20, 0};
  b.shape(sphere, bsdf);
  b.shape(Disk{{translate({-4, 30, 0}), translate({4, 30, 0})}, false}, bsdf);
  const Traced t(b.scene);
  const std::size_t n = 80;
  Workspace w;
  w.resize(n);
  for (int s = 0; s < 4; ++s) {
    for (std::size_t i = 0; i < n; ++i) w.rays.set(i, {0, 10.0f * s, 5}, {0, 0, -1}, 1e9f, (i + 0.5f) / n);
    t.embree.intersect(w.rays, n, w.hits, true);
    for (std::size_t i = 0; i < n; ++i)
      EXPECT_EQ(w.hits.shape[i] == static_cast<std::uint32_t>(s), std::fabs(-4 + 8 * w.rays.time[i]) < 1)
          << "shape " << s << " at time " << w.rays.time[i];
  }
}

}  // namespace
}  // namespace warpath
