#pragma once
#include <cmath>
#include <numeric>
#include <vector>

#include "core/rng.h"
#include "scene/scene.h"
#include "tracer/tracer.h"

// For tests: scenes built in code, and statistics of what the tracer makes of them.
namespace warpath::testing {

inline Matrix4 translate(const Vec3& t) {
  Matrix4 m;
  m.setTranslation(t);
  return m;
}
inline Matrix4 scale(const Vec3& s) {
  Matrix4 m;
  m.setScale(s);
  return m;
}
/// Camera to world: +z to the target, +y up, +x to the left.
inline Matrix4 look_at(const Vec3& origin, const Vec3& target, const Vec3& up) {
  const Vec3 d = (target - origin).normalized(), left = up.cross(d).normalized(), v = d.cross(left);
  return {left.x, left.y, left.z, 0, v.x, v.y, v.z, 0, d.x, d.y, d.z, 0, origin.x, origin.y, origin.z, 1};
}
/// The square [-1,1]^2 with its normal turned from +z to `normal`, scaled and moved.
inline Matrix4 facing(const Vec3& center, const Vec3& normal, float half_size) {
  const Vec3 helper = std::fabs(normal.y) < 0.9f ? Vec3(0, 1, 0) : Vec3(1, 0, 0);
  Matrix4 m = look_at(center, center + normal, helper);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) m[r][c] *= half_size;
  return m;
}

struct SceneBuilder {
  Scene scene;
  SceneBuilder() {
    scene.film.width = scene.film.crop_width = 64;
    scene.film.height = scene.film.crop_height = 64;
    scene.sensor.near_clip = 1e-3f;
    look({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 40);
  }
  void look(const Vec3& origin, const Vec3& target, const Vec3& up, float fov) {
    scene.sensor.to_world[0] = scene.sensor.to_world[1] = look_at(origin, target, up);
    scene.sensor.x_fov = fov;
  }
  TextureId constant(const Color& value) {
    scene.textures.push_back(ConstantTexture{value});
    return static_cast<TextureId>(scene.textures.size() - 1);
  }
  BsdfId diffuse(const Color& reflectance) {
    scene.bsdfs.push_back({"", Diffuse{constant(reflectance)}});
    return static_cast<BsdfId>(scene.bsdfs.size() - 1);
  }
  template <class Model>
  BsdfId bsdf(const Model& model) {
    scene.bsdfs.push_back({"", model});
    return static_cast<BsdfId>(scene.bsdfs.size() - 1);
  }
  template <class Model>
  int emitter(const Model& model) {
    scene.emitters.push_back({"", 1.0f, model});
    return static_cast<int>(scene.emitters.size() - 1);
  }
  template <class Geometry>
  int shape(const Geometry& geometry, BsdfId bsdf) {
    scene.shapes.push_back({"", geometry, bsdf, -1});
    return static_cast<int>(scene.shapes.size() - 1);
  }
  template <class Geometry>
  int light(const Geometry& geometry, BsdfId bsdf, TextureId radiance) {
    const int s = shape(geometry, bsdf);
    scene.shapes.back().emitter = emitter(AreaEmitter{s, radiance});
    return s;
  }
  template <class Geometry>
  int light(const Geometry& geometry, const Color& radiance) {
    return light(geometry, diffuse(Color(0.0f)), constant(radiance));
  }
  /// The square [-1,1]^2 in the xy plane, normal +z, cut into 2 n^2 triangles, then transformed.
  static Mesh grid(int n, const Matrix4& m) {
    Mesh mesh;
    for (int y = 0; y <= n; ++y)
      for (int x = 0; x <= n; ++x) {
        Vec3 p;
        m.multVecMatrix(Vec3(2.0f * x / n - 1, 2.0f * y / n - 1, 0), p);
        mesh.positions.push_back(p);
        mesh.uvs.push_back({static_cast<float>(x) / n, static_cast<float>(y) / n});
      }
    mesh.positions.push_back(Vec3(0));
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const auto i = static_cast<std::uint32_t>(y * (n + 1) + x), up = static_cast<std::uint32_t>(n + 1);
        mesh.indices.insert(mesh.indices.end(), {i, i + 1, i + up, i + 1, i + up + 1, i + up});
      }
    return mesh;
  }
  /// Inside faces of the cube [-1,1]^3.
  void box(BsdfId bsdf, TextureId radiance = -1) {
    for (int axis = 0; axis < 3; ++axis)
      for (const float side : {-1.0f, 1.0f}) {
        Vec3 n(0);
        n[axis] = side;
        const Matrix4 m = facing(n, -n, 1);
        if (radiance >= 0)
          light(Rectangle{{m, m}, false}, bsdf, radiance);
        else
          shape(Rectangle{{m, m}, false}, bsdf);
      }
  }
};

inline Sphere make_sphere(const Vec3& center, float radius, bool flip = false) {
  return {{center, center}, {radius, radius}, scale(Vec3(radius)) * translate(center), flip};
}
inline Rectangle make_rectangle(const Matrix4& m, bool flip = false) { return {{m, m}, flip}; }

struct Estimate {
  double mean[3] = {}, error[3] = {};  ///< per channel, and the standard error of the mean
};

inline std::vector<std::uint64_t> make_ids(std::uint64_t first, std::size_t n) {
  std::vector<std::uint64_t> ids(n);
  std::iota(ids.begin(), ids.end(), first);
  return ids;
}

/// Mean radiance over the film of n paths, or of directly seen emission alone.
inline Estimate estimate(const Tracer& tracer, std::uint64_t seed, std::size_t n, bool emission = false) {
  Estimate e;
  double sum[3] = {}, squares[3] = {};
  PathResults results;
  for (std::size_t first = 0; first < n; first += 2048) {
    const auto ids = make_ids(first, std::min<std::size_t>(2048, n - first));
    UniformSource source(seed, ids);
    emission ? tracer.trace_emission(source, ids.size(), results) : tracer.trace(source, ids.size(), results);
    for (std::size_t i = 0; i < ids.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        const double v = results.radiance[i][c];
        sum[c] += v, squares[c] += v * v;
      }
  }
  const auto count = static_cast<double>(n);
  for (int c = 0; c < 3; ++c) {
    e.mean[c] = sum[c] / count;
    e.error[c] = std::sqrt(std::max(0.0, squares[c] / count - e.mean[c] * e.mean[c]) / (count - 1));
  }
  return e;
}

}  // namespace warpath::testing
