#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "scene/object.h"
#include "scene/scene.h"

namespace warpath {

/// What the loaders of the parts of a scene share while it loads. Files are only noted (add_job) while the tree of
/// objects is walked, and read afterwards, in parallel.
class LoadContext {
 public:
  LoadContext(Scene& loaded, const SceneOptions& load_options, std::vector<std::filesystem::path> folders)
      : scene(loaded), options(load_options), m_folders(std::move(folders)) {}

  Scene& scene;
  const SceneOptions& options;
  double shutter_open = 0, shutter_close = 0;  ///< known before shapes are loaded: keyframes are evaluated there
  std::map<const Object*, BsdfId> bsdfs;       ///< each is loaded once, however often it is referred to
  std::map<const Object*, TextureId> textures;
  std::set<const Object*> attached_emitters;  ///< area emitters that a shape has

  /// The file that a property names; SceneError if there is none, with the nearest name in its folder.
  std::filesystem::path find(const Object& object, std::string_view property) const;

  /// Work that reads a file of about `bytes`, for run_jobs(); what it throws is reported for the place `where`.
  void add_job(const Location& where, const std::filesystem::path& file, std::function<void()> work);
  /// Does all jobs on all threads. Throws the SceneError of the first that failed, in the order of the file.
  void run_jobs();

  /// An image for a texture; the same file gives the same image. Its pixels are there after run_jobs().
  /// Colours of 8 and 16 bits carry the sRGB curve unless raw is set; float ones are linear.
  std::shared_ptr<const Image> texture_image(const Location& where, const std::filesystem::path& file, bool raw);
  /// The same as linear float RGB.
  std::shared_ptr<const Image> environment_image(const Location& where, const std::filesystem::path& file);

  TextureId add_texture(Texture texture);
  BsdfId add_bsdf(Bsdf bsdf);

 private:
  struct Job {
    Location where;
    std::uintmax_t bytes;
    std::function<void()> work;
  };
  std::vector<std::filesystem::path> m_folders;
  std::vector<Job> m_jobs;
  std::map<std::string, std::shared_ptr<Image>> m_images;
};

/// What a colour is for; decides its range, and how Mitsuba's RGB variants turn a spectrum into RGB.
enum class ColorRole : std::uint8_t { reflectance, unbounded, emission };

// A property that may be a number, a colour, a spectrum or a texture: as a texture, or as a colour if only constants
// make sense there.
TextureId get_texture(LoadContext& context, const Object& object, std::string_view name, float missing, ColorRole role);
Color get_color(LoadContext& context, const Object& object, std::string_view name, float missing, ColorRole role);
TextureId load_texture(LoadContext& context, const Object& object, ColorRole role);

/// The row of a table of plugins for the type of an object; SceneError with the nearest name if there is none.
template <class Plugins>
const auto& find_plugin(const Plugins& plugins, const Object& object) {
  std::vector<std::string_view> names;
  for (const auto& plugin : plugins) {
    if (plugin.name == object.type) return plugin;
    names.push_back(plugin.name);
  }
  fail(object.where, "unknown {} \"{}\";{}", object.tag, object.type, suggestion(object.type, names));
}

BsdfId load_bsdf(LoadContext& context, const Object& object);
/// An emitter that stands by itself in the scene.
void load_emitter(LoadContext& context, const Object& object);
/// The area emitter of a shape; gives its index.
std::int32_t load_area_emitter(LoadContext& context, const Object& object, std::int32_t shape);
void load_shape(LoadContext& context, const Object& object);
/// The sensor with its film and sampler, and the shutter's times.
void load_sensor(LoadContext& context, const Object& object);
void load_integrator(LoadContext& context, const Object& object);

/// The index of refraction that `name` gives, as a number or as a material's name.
float get_ior(const Object& object, std::string_view name, std::string_view missing);
/// Complex index of refraction of a conductor by its name; null if unknown.
struct Metal {
  std::string_view name;
  float eta[3], k[3];
};
const Metal* find_metal(std::string_view name);
std::vector<std::string_view> metal_names();

/// Linear RGB of a spectrum, as Mitsuba 3's RGB variants have it; SceneError at `where` for what they refuse.
Color spectrum_to_rgb(const SpectrumValue& spectrum, ColorRole role, const Location& where);

/// The matrices at the opening and the closing of the shutter.
struct Motion {
  Matrix4 matrix[2];
  bool moving = false;
};
Motion get_motion(const LoadContext& context, const Object& object, std::string_view name);
/// A transform that must stand still.
Imath::M44d get_still_transform(const Object& object, std::string_view name);

}  // namespace warpath
