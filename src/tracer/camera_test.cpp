#include "tracer/camera.h"

#include <gtest/gtest.h>

#include "tracer/sampling.h"
#include "tracer/test_scene.h"

namespace warpath {
namespace {

using testing::look_at;

Sensor make_sensor() {
  Sensor s;
  s.to_world[0] = s.to_world[1] = look_at({1, 2, 3}, {-2, 0.5f, 1}, {0, 1, 0});
  s.x_fov = 50;
  s.near_clip = 0.1f;
  s.far_clip = 50;
  s.focus_distance = 4;
  return s;
}
FilmSettings make_film() {
  FilmSettings f;
  f.width = f.crop_width = 160;
  f.height = f.crop_height = 90;
  return f;
}

TEST(Camera, MiddleOfTheFilmLooksAtTheTargetAndEdgesAtTheFieldOfView) {
  const Camera camera(make_sensor(), make_film());
  const Vec3 forward = (Vec3(-2, 0.5f, 1) - Vec3(1, 2, 3)).normalized();
  const auto middle = camera.ray({0.5f, 0.5f}, {0, 0}, 0);
  EXPECT_NEAR((middle.direction - forward).length(), 0, 1e-6f);
  EXPECT_NEAR((middle.origin - (Vec3(1, 2, 3) + forward * 0.1f)).length(), 0, 1e-6f);
  EXPECT_NEAR(middle.t_max, 49.9f, 1e-3f);
  const auto left = camera.ray({0, 0.5f}, {0, 0}, 0), top = camera.ray({0.5f, 0}, {0, 0}, 0);
  EXPECT_NEAR(std::acos(left.direction.dot(forward)) * 180 / kPi, 25, 1e-3f);
  EXPECT_GT(top.direction.y, forward.y) << "the film's y runs down";
  EXPECT_NEAR(std::tan(std::acos(top.direction.dot(forward))), std::tan(25 * kPi / 180) * 90 / 160, 1e-5f);
  EXPECT_GT(left.direction.dot(Vec3(0, 1, 0).cross(forward)), 0) << "the film's x runs to the right";
}

TEST(Camera, ProjectUndoesRay) {
  Sensor sensor = make_sensor();
  sensor.principal_x = 0.1f, sensor.principal_y = -0.07f;
  const Camera camera(sensor, make_film());
  for (int i = 0; i < 100; ++i) {
    const Vec2 film(sample_float(1, 2 * i), sample_float(1, 2 * i + 1));
    const auto ray = camera.ray(film, {0, 0}, 0);
    const Vec3 p = camera.project(ray.origin + ray.direction * 7);
    EXPECT_NEAR(p.x / p.z, film.x, 1e-4f);
    EXPECT_NEAR(p.y / p.z, film.y, 1e-4f);
  }
}

TEST(Camera, RaysThroughTheLensMeetInThePlaneOfFocus) {
  Sensor sensor = make_sensor();
  const Camera pinhole(sensor, make_film());
  sensor.aperture_radius = 0.3f;
  const Camera lens(sensor, make_film());
  const Vec3 forward = (Vec3(-2, 0.5f, 1) - Vec3(1, 2, 3)).normalized();
  const Vec2 film(0.2f, 0.8f);
  const auto to_focus = [&](const Camera::Ray& r) {
    const float t = (4 - (r.origin - Vec3(1, 2, 3)).dot(forward)) / r.direction.dot(forward);
    return r.origin + r.direction * t;
  };
  const Vec3 sharp = to_focus(pinhole.ray(film, {0, 0}, 0));
  for (int i = 0; i < 50; ++i) {
    const auto ray = lens.ray(film, {sample_float(2, 2 * i), sample_float(2, 2 * i + 1)}, 0);
    EXPECT_NEAR((to_focus(ray) - sharp).length(), 0, 1e-4f);
    const Vec3 on_lens =
        ray.origin - ray.direction * ((ray.origin - Vec3(1, 2, 3)).dot(forward) / ray.direction.dot(forward));
    EXPECT_LE((on_lens - Vec3(1, 2, 3)).length(), 0.3f + 1e-5f);
  }
}

TEST(Camera, MovingCameraStandsAtItsKeyframesAndTurnsHalfwayBetween) {
  for (const bool mirrored : {false, true}) {
    Sensor a = make_sensor(), b = make_sensor();
    b.to_world[0] = b.to_world[1] = look_at({3, 2, 3}, {6, 3, -1}, {0, 1, 0});
    if (mirrored)
      for (Sensor* s : {&a, &b})
        for (Matrix4& m : s->to_world)
          for (int k = 0; k < 3; ++k) m[0][k] = -m[0][k];
    Sensor moving = a;
    moving.to_world[1] = b.to_world[0];
    const Camera start(a, make_film()), end(b, make_film()), camera(moving, make_film());
    EXPECT_TRUE(camera.moves());
    const Vec2 film(0.1f, 0.7f);
    EXPECT_NEAR((camera.ray(film, {0, 0}, 0).direction - start.ray(film, {0, 0}, 0).direction).length(), 0, 1e-5f);
    EXPECT_NEAR((camera.ray(film, {0, 0}, 1).direction - end.ray(film, {0, 0}, 0).direction).length(), 0, 1e-5f);
    const auto half = camera.ray({0.5f, 0.5f}, {0, 0}, 0.5f);
    EXPECT_NEAR(half.direction.length(), 1, 1e-6f);
    const Vec3 da = start.ray({0.5f, 0.5f}, {0, 0}, 0).direction, db = end.ray({0.5f, 0.5f}, {0, 0}, 0).direction;
    EXPECT_NEAR(half.direction.dot(da), half.direction.dot(db), 1e-5f);
    EXPECT_NEAR((half.origin - half.direction * 0.1f - Vec3(2, 2, 3)).length(), 0, 1e-4f);
  }
}

}  // namespace
}  // namespace warpath
