#include "tracer/analytic_shape.h"

#include <gtest/gtest.h>

#include "tracer/sampling.h"
#include "tracer/test_scene.h"

namespace warpath {
namespace {

using testing::make_sphere;
using testing::scale;
using testing::translate;

TEST(AnalyticShape, SphereIsHitWhereTheFormulaSays) {
  const AnalyticShape sphere(make_sphere({1, 2, 3}, 2));
  float t = 0;
  ASSERT_TRUE(sphere.intersect({1, 2, 10}, {0, 0, -1}, 0, 0, 1e9f, t));
  EXPECT_FLOAT_EQ(t, 5);
  ASSERT_TRUE(sphere.intersect({1, 2, 3}, {1, 0, 0}, 0, 0, 1e9f, t)) << "from within";
  EXPECT_FLOAT_EQ(t, 2);
  EXPECT_FALSE(sphere.intersect({1, 4.001f, 10}, {0, 0, -1}, 0, 0, 1e9f, t));
  EXPECT_FALSE(sphere.intersect({1, 2, 10}, {0, 0, -1}, 0, 0, 4.999f, t)) << "beyond the ray's end";
  EXPECT_FALSE(sphere.intersect({1, 2, 10}, {0, 0, 1}, 0, 0, 1e9f, t)) << "behind the origin";
  ASSERT_TRUE(sphere.intersect({1, 3, 10}, {0, 0, -1}, 0, 0, 1e9f, t));
  EXPECT_NEAR(t, 7 - std::sqrt(3.0f), 1e-6f);
  const auto s = sphere.at({1, 3, 3 + std::sqrt(3.0f)}, 0);
  EXPECT_NEAR((s.normal - Vec3(0, 0.5f, std::sqrt(0.75f))).length(), 0, 1e-6f);
}

TEST(AnalyticShape, SmallSphereFarAway) {
  const AnalyticShape sphere(make_sphere({0, 0, -1e5f}, 1e-3f));
  float t = 0;
  EXPECT_TRUE(sphere.intersect({0, 0, 0}, {0, 0, -1}, 0, 0, 1e9f, t));
  EXPECT_FALSE(sphere.intersect({0, 2e-3f, 0}, {0, 0, -1}, 0, 0, 1e9f, t));
}

TEST(AnalyticShape, DiskAndItsCoordinates) {
  const Matrix4 m = scale({2, 2, 1}) * translate({0, 0, 1});
  const AnalyticShape disk(Disk{{m, m}, false}), flipped(Disk{{m, m}, true});
  float t = 0;
  ASSERT_TRUE(disk.intersect({0, 1.99f, 5}, {0, 0, -1}, 0, 0, 1e9f, t));
  EXPECT_FLOAT_EQ(t, 4);
  EXPECT_FALSE(disk.intersect({0, 2.01f, 5}, {0, 0, -1}, 0, 0, 1e9f, t));
  const auto s = disk.at({0, 1, 1}, 0);
  EXPECT_NEAR(s.uv.x, 0.5f, 1e-6f);
  EXPECT_NEAR(s.uv.y, 0.25f, 1e-6f);
  EXPECT_NEAR((s.normal - Vec3(0, 0, 1)).length(), 0, 1e-6f);
  EXPECT_NEAR((flipped.at({0, 1, 1}, 0).normal - Vec3(0, 0, -1)).length(), 0, 1e-6f);
  // The radius is 2 and u runs over it; v takes 2 pi r.
  EXPECT_NEAR(s.dp_du.length(), 2, 1e-5f);
  EXPECT_NEAR(s.dp_dv.length(), 2 * kPi, 1e-5f);
}

TEST(AnalyticShape, CylinderFromOutsideInsideAndAlongItsAxis) {
  const Matrix4 m = scale({1, 1, 3});
  const AnalyticShape cylinder(Cylinder{{m, m}, false});
  float t = 0;
  ASSERT_TRUE(cylinder.intersect({5, 0, 1.5f}, {-1, 0, 0}, 0, 0, 1e9f, t));
  EXPECT_FLOAT_EQ(t, 4);
  ASSERT_TRUE(cylinder.intersect({0, 0, 1.5f}, {-1, 0, 0}, 0, 0, 1e9f, t));
  EXPECT_FLOAT_EQ(t, 1);
  EXPECT_FALSE(cylinder.intersect({0, 0, -1}, {0, 0, 1}, 0, 0, 1e9f, t)) << "it has no caps";
  EXPECT_FALSE(cylinder.intersect({5, 0, 3.1f}, {-1, 0, 0}, 0, 0, 1e9f, t));
  // Down through the open top onto the far wall: the nearer wall is only crossed above the top.
  const Vec3 d = Vec3(-1, 0, -1).normalized();
  ASSERT_TRUE(cylinder.intersect({1.5f, 0, 4.5f}, d, 0, 0, 1e9f, t));
  EXPECT_NEAR(t, 2.5f * std::sqrt(2.0f), 1e-5f);
  const auto s = cylinder.at({0, 1, 1.5f}, 0);
  EXPECT_NEAR((s.normal - Vec3(0, 1, 0)).length(), 0, 1e-6f);
  EXPECT_NEAR((s.uv - Vec2(0.25f, 0.5f)).length(), 0, 1e-6f);
}

TEST(AnalyticShape, TangentsAreDerivativesOfThePosition) {
  Matrix4 m;
  m.setEulerAngles(Vec3(0.3f, -0.7f, 1.1f));
  m = scale({1.5f, 1.5f, 2}) * m * translate({1, -2, 0.5f});
  Matrix4 turn;
  turn.setEulerAngles(Vec3(0.2f, 0.4f, -0.5f));
  Sphere sphere = make_sphere({1, 2, 3}, 1.5f);
  sphere.to_world = scale(Vec3(1.5f)) * turn * translate({1, 2, 3});
  const AnalyticShape shapes[] = {AnalyticShape(sphere), AnalyticShape(Disk{{m, m}, false}),
                                  AnalyticShape(Cylinder{{m, m}, false})};
  for (const AnalyticShape& shape : shapes) {
    const Vec3 inside =
        transform_point(shape.to_world(0), {0.4f, 0.5f, shape.kind() == AnalyticShape::Kind::disk ? 0 : 0.6f});
    const auto s = shape.at(inside, 0);
    const float step = 1e-3f;
    for (const bool along_u : {true, false}) {
      const Vec3 tangent = along_u ? s.dp_du : s.dp_dv;
      const auto moved = shape.at(s.position + tangent * step, 0);
      const Vec2 change = (moved.uv - s.uv) / step;
      EXPECT_NEAR(change.x, along_u ? 1 : 0, 0.02f) << static_cast<int>(shape.kind());
      EXPECT_NEAR(change.y, along_u ? 0 : 1, 0.02f) << static_cast<int>(shape.kind());
      const Vec3 turned = (moved.normal - s.normal) / step, expected = along_u ? s.dn_du : s.dn_dv;
      EXPECT_NEAR((turned - expected).length(), 0, 0.05f * (1 + expected.length())) << static_cast<int>(shape.kind());
    }
  }
}

}  // namespace
}  // namespace warpath
