#include <array>

#include "cli/commands.h"
#include "core/tensor_file.h"
#include "family/warp_file.h"
#include "scene/scene.h"
#include "warpath/error.h"

namespace warpath {
namespace {

void inspect_warp(const std::filesystem::path& path) {
  const WarpFile warp = load_warp(path);
  fmt::print("family      {}\n", family_of(warp));
  if (warp.proposal || warp.layout.dims() > 0)
    fmt::print("dimensions  {} ({})\n", warp.layout.dims(), warp.layout.name());
  else
    fmt::print("dimensions  light, light_uv, lobe and dir of every vertex\n");
  fmt::print("scene       {}\n", warp.scene);
  for (const auto& [name, value] : warp.settings) fmt::print("{:<11} {}\n", name, value);
  fmt::print("tensors\n");
  const TensorFile tensors = TensorFile::load(path);
  for (const auto& [name, tensor] : tensors.entries())
    fmt::print("  {:<40} {} {}\n", name, tensor.dtype, fmt::format("[{}]", fmt::join(tensor.shape, ", ")));
}

void inspect_scene(const SceneRequest& request) {
  const Scene scene = load_scene(request);
  std::size_t triangles = 0, meshes = 0;
  for (const Shape& shape : scene.shapes)
    if (const Mesh* mesh = std::get_if<Mesh>(&shape.geometry)) {
      triangles += mesh->triangle_count();
      ++meshes;
    }
  constexpr std::array<const char*, 6> kEmitters{"area", "envmap", "constant", "point", "spot", "directional"};
  std::array<int, 6> emitters{};
  for (const Emitter& emitter : scene.emitters) ++emitters[emitter.model.index()];
  fmt::print("film        {} x {}\nspp         {}\nmax_depth   {}\nrr_depth    {}\n", scene.film.width,
             scene.film.height, scene.sample_count, scene.integrator.max_depth, scene.integrator.rr_depth);
  fmt::print("shapes      {} ({} meshes, {} triangles)\nbsdfs       {}\ntextures    {}\nemitters    {}\n",
             scene.shapes.size(), meshes, triangles, scene.bsdfs.size(), scene.textures.size(), scene.emitters.size());
  for (std::size_t k = 0; k < emitters.size(); ++k)
    if (emitters[k]) fmt::print("  {:<11} {}\n", kEmitters[k], emitters[k]);
  fmt::print("dimensions  film, ");
  if (scene.sensor.aperture_radius > 0) fmt::print("lens, ");
  if (scene.sensor.shutter_close > scene.sensor.shutter_open) fmt::print("time, ");
  fmt::print("bounceK.light, bounceK.light_uv, bounceK.lobe, bounceK.dir, bounceK.rr");
  fmt::print(" (K = 1 ... {})\n",
             scene.integrator.max_depth < 0 ? "any" : std::to_string(scene.integrator.max_depth - 1));
}

}  // namespace

void run(const InspectCommand& command) {
  if (command.scene.file.extension() == ".xml")
    inspect_scene(command.scene);
  else
    inspect_warp(command.scene.file);
}

}  // namespace warpath
