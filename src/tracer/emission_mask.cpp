#include "tracer/emission_mask.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "tracer/sampling.h"

namespace warpath {
namespace {

// A corner in camera space after projection: film position times z, and z.
using Polygon = std::vector<Vec3>;

constexpr float kMargin = 0.01f;   // pixels, against rounding
constexpr float kNearest = 1e-6f;  // polygons are cut off at this depth, in scene units

// The part of a polygon where `inside` (linear in the corners) is not negative. [Sutherland and Hodgman 1974]
template <class Inside>
void clip(const Polygon& polygon, Inside inside, Polygon& result) {
  result.clear();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec3 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const float fa = inside(a), fb = inside(b);
    if (fa >= 0) result.push_back(a);
    if ((fa >= 0) != (fb >= 0)) result.push_back(a + (b - a) * (fa / (fa - fb)));
  }
}

class Rasterizer {
 public:
  Rasterizer(const Camera& camera, const FilmSettings& film)
      : m_camera(camera),
        m_film(film),
        m_width(film.crop_width),
        m_height(film.crop_height),
        m_mask(static_cast<std::size_t>(m_width) * m_height) {}

  // Marks every pixel that a convex polygon may touch.
  void add(std::span<const Vec3> corners) {
    m_projected.clear();
    for (const Vec3& corner : corners) m_projected.push_back(m_camera.project(corner));
    clip(
        m_projected, [](const Vec3& p) { return p.z - kNearest; }, m_visible);
    if (m_visible.empty()) return;
    // After the cut every z is positive; from here on in pixels of the crop window.
    m_pixels.clear();
    float top = INFINITY, bottom = -INFINITY;
    for (const Vec3& p : m_visible) {
      const float x = p.x / p.z * static_cast<float>(m_film.width) - static_cast<float>(m_film.crop_x);
      const float y = p.y / p.z * static_cast<float>(m_film.height) - static_cast<float>(m_film.crop_y);
      m_pixels.push_back({x, y, 0});
      top = std::min(top, y), bottom = std::max(bottom, y);
    }
    const int first = row_of(top - kMargin), last = row_of(bottom + kMargin);
    for (int y = first; y <= last; ++y) mark_row(y);
  }

  std::vector<std::uint8_t> take() { return std::move(m_mask); }

 private:
  int row_of(float y) const { return static_cast<int>(std::clamp(std::floor(y), -1.0f, static_cast<float>(m_height))); }

  void mark_row(int y) {
    if (y < 0 || y >= m_height) return;
    const float upper = static_cast<float>(y) - kMargin, lower = static_cast<float>(y + 1) + kMargin;
    clip(
        m_pixels, [&](const Vec3& p) { return p.y - upper; }, m_band);
    clip(
        m_band, [&](const Vec3& p) { return lower - p.y; }, m_row);
    if (m_row.empty()) return;
    float left = INFINITY, right = -INFINITY;
    for (const Vec3& p : m_row) left = std::min(left, p.x), right = std::max(right, p.x);
    if (right + kMargin < 0 || left - kMargin >= static_cast<float>(m_width)) return;
    const auto column = [&](float x) {
      return static_cast<std::size_t>(std::clamp(std::floor(x), 0.0f, static_cast<float>(m_width - 1)));
    };
    const auto row = m_mask.begin() + static_cast<std::ptrdiff_t>(y) * m_width;
    std::fill(row + static_cast<std::ptrdiff_t>(column(left - kMargin)),
              row + static_cast<std::ptrdiff_t>(column(right + kMargin)) + 1, std::uint8_t{1});
  }

  const Camera& m_camera;
  const FilmSettings& m_film;
  int m_width, m_height;
  std::vector<std::uint8_t> m_mask;
  Polygon m_projected, m_visible, m_pixels, m_band, m_row;
};

void add_box(const AnalyticShape::Bounds& box, Rasterizer& rasterizer) {
  for (int axis = 0; axis < 3; ++axis)
    for (const bool upper : {false, true}) {
      std::array<Vec3, 4> corners;
      for (int k = 0; k < 4; ++k) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        corners[k][axis] = (upper ? box.upper : box.lower)[axis];
        corners[k][u] = (k == 1 || k == 2 ? box.upper : box.lower)[u];
        corners[k][v] = (k >= 2 ? box.upper : box.lower)[v];
      }
      rasterizer.add(corners);
    }
}

void extend(AnalyticShape::Bounds& box, const Vec3& p) {
  for (int k = 0; k < 3; ++k) {
    box.lower[k] = std::min(box.lower[k], p[k]);
    box.upper[k] = std::max(box.upper[k], p[k]);
  }
}

void add_shape(const Shape& shape, const AnalyticShape* analytic, const Vec3& eye, Rasterizer& rasterizer) {
  AnalyticShape::Bounds box{Vec3(INFINITY), Vec3(-INFINITY)};
  if (const auto* mesh = std::get_if<Mesh>(&shape.geometry)) {
    if (!mesh->positions_end.empty()) {
      for (std::size_t i = 0; i < mesh->vertex_count(); ++i) {
        extend(box, mesh->positions[i]);
        extend(box, mesh->positions_end[i]);
      }
      return add_box(box, rasterizer);
    }
    for (std::size_t t = 0; t < mesh->triangle_count(); ++t) {
      const std::uint32_t* i = &mesh->indices[3 * t];
      const std::array<Vec3, 3> corners{mesh->positions[i[0]], mesh->positions[i[1]], mesh->positions[i[2]]};
      const Vec3 ng = (corners[1] - corners[0]).cross(corners[2] - corners[0]) * (mesh->flip_normals ? -1.0f : 1.0f);
      if (mesh->normals.empty() && ng.dot(eye - corners[0]) < 0) continue;
      rasterizer.add(corners);
    }
  } else if (const auto* rectangle = std::get_if<Rectangle>(&shape.geometry)) {
    std::array<Vec3, 4> corners;
    constexpr std::array<Vec2, 4> kCorners{Vec2(-1, -1), Vec2(1, -1), Vec2(1, 1), Vec2(-1, 1)};
    for (const Matrix4& m : rectangle->to_world)
      for (std::size_t k = 0; k < 4; ++k) {
        corners[k] = transform_point(m, {kCorners[k].x, kCorners[k].y, 0});
        extend(box, corners[k]);
      }
    if (rectangle->to_world[0] != rectangle->to_world[1]) return add_box(box, rasterizer);
    if (rectangle_normal(*rectangle, 0).dot(eye - corners[0]) >= 0) rasterizer.add(corners);
  } else {
    for (const float time : {0.0f, 1.0f}) {
      const auto b = analytic->bounds(time);
      extend(box, b.lower);
      extend(box, b.upper);
    }
    add_box(box, rasterizer);
  }
}

}  // namespace

std::vector<std::uint8_t> find_emission_mask(const CompiledScene& compiled) {
  const Scene& scene = compiled.scene;
  const FilmSettings& film = scene.film;
  const std::size_t pixels = static_cast<std::size_t>(film.crop_width) * film.crop_height;
  if (scene.integrator.hide_emitters || scene.integrator.max_depth == 0) return std::vector<std::uint8_t>(pixels, 0);
  const bool has_area =
      std::any_of(scene.shapes.begin(), scene.shapes.end(), [](const Shape& s) { return s.emitter >= 0; });
  if (compiled.emitters.has_environment() || (has_area && (compiled.camera.has_lens() || compiled.camera.moves())))
    return std::vector<std::uint8_t>(pixels, 1);
  Rasterizer rasterizer(compiled.camera, film);
  for (std::size_t i = 0; i < scene.shapes.size(); ++i)
    if (scene.shapes[i].emitter >= 0)
      add_shape(scene.shapes[i], compiled.surfaces.analytic()[i], compiled.camera.position(), rasterizer);
  return rasterizer.take();
}

}  // namespace warpath
