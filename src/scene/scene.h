#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "scene/bsdf.h"
#include "scene/shape.h"
#include "scene/texture.h"

namespace warpath {

struct AreaEmitter {
  std::int32_t shape;  ///< index into Scene::shapes
  TextureId radiance;
};
/// Equirectangular image: u = 0.5 is local -z or as Mitsuba's `envmap` has it; y is up before to_world.
struct EnvmapEmitter {
  std::shared_ptr<const Image> image;  ///< float, 3 channels
  float scale = 1;
  Matrix4 to_world;
};
struct ConstantEmitter {
  Color radiance{1.0f};
};
struct PointEmitter {
  Vec3 position;
  Color intensity{1.0f};
};
struct SpotEmitter {
  Matrix4 to_world;
  Color intensity{1.0f};
  TextureId texture = -1;                    ///< projected; -1 for none
  float cutoff_angle = 20, beam_width = 15;  ///< degrees
};
struct DirectionalEmitter {
  Vec3 direction;  ///< unit, the way the light travels
  Color irradiance{1.0f};
};
struct Emitter {
  std::string id;
  float sampling_weight = 1;
  std::variant<AreaEmitter, EnvmapEmitter, ConstantEmitter, PointEmitter, SpotEmitter, DirectionalEmitter> model;
};

struct Sensor {
  Matrix4 to_world[2];     ///< at shutter_open and shutter_close; the same for a camera that stands still
  float x_fov = 39.5978f;  ///< degrees, across the width of the film, fov_axis already applied
  float principal_x = 0, principal_y = 0;
  float near_clip = 1e-2f, far_clip = 1e4f;
  float aperture_radius = 0;  ///< 0 is the pinhole
  float focus_distance = 0;
  float shutter_open = 0, shutter_close = 0;
};

struct ReconstructionFilter {
  enum class Type : std::uint8_t { box, tent, gaussian, mitchell } type = Type::gaussian;
  float radius = 2;                  ///< pixels, from the centre
  float stddev = 0.5f;               ///< gaussian
  float b = 1 / 3.0f, c = 1 / 3.0f;  ///< mitchell
};
struct FilmSettings {
  int width = 768, height = 576;
  int crop_x = 0, crop_y = 0, crop_width = 768, crop_height = 576;
  ReconstructionFilter filter;
};
struct IntegratorSettings {
  int max_depth = -1;  ///< as Mitsuba's: -1 unbounded, 1 directly seen emission only
  int rr_depth = 5;
  bool hide_emitters = false;
};

/// A scene as it stands in its file, checked and with its meshes and images read; the tracer compiles it for rendering.
struct Scene {
  std::filesystem::path file;
  std::vector<Texture> textures;
  std::vector<Bsdf> bsdfs;
  std::vector<Shape> shapes;
  std::vector<Emitter> emitters;
  Sensor sensor;
  FilmSettings film;
  IntegratorSettings integrator;
  int sample_count = 4;  ///< spp in the file, or Mitsuba's default
};

struct SceneOptions {
  std::vector<std::pair<std::string, std::string>> defines;  ///< -D name=value
  int width = 0,
      height = 0;     ///< film size that replaces the file's; 0 keeps it. Applied before the field of view is resolved
  int max_depth = 0;  ///< replaces the file's; 0 keeps it
};

/// Reads a Mitsuba 3 scene file. Throws SceneError with file:line:column, what is wrong, and what would be right.
Scene load_scene(const std::filesystem::path& file, const SceneOptions& options = {});

}  // namespace warpath
