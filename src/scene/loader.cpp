#include "scene/loader.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <exception>
#include <numeric>

#include "core/log.h"
#include "scene/mesh_file.h"

namespace warpath {

namespace fs = std::filesystem;

fs::path LoadContext::find(const Object& object, std::string_view property) const {
  const fs::path name = object.require_string(property);
  const Location& where = object.find(property)->where;
  std::vector<fs::path> folders = m_folders;
  folders.push_back(where.file->path.parent_path());  // of an included file
  const fs::path found = find_file(folders, name);
  std::error_code error;
  if (fs::is_regular_file(found, error)) return found;

  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(found.parent_path(), error)) names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  const std::vector<std::string_view> known(names.begin(), names.end());
  const std::string hint = known.empty() ? "" : suggestion(found.filename().string(), known);
  if (hint.find("did you mean") != std::string::npos) fail(where, "there is no file \"{}\";{}", name.string(), hint);
  fail(where, "there is no file \"{}\" in \"{}\"", name.string(), fs::absolute(m_folders.back(), error).string());
}

void LoadContext::add_job(const Location& where, const fs::path& file, std::function<void()> work) {
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(file, error);
  m_jobs.push_back({where, error ? 0 : bytes, std::move(work)});
}

void LoadContext::run_jobs() {
  // The largest first, so that no thread is left alone with one at the end.
  std::vector<std::size_t> order(m_jobs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return m_jobs[a].bytes > m_jobs[b].bytes; });
  std::vector<std::string> errors(m_jobs.size());
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, order.size(), 1),
      [&](const tbb::blocked_range<std::size_t>& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          const std::size_t job = order[i];
          try {
            m_jobs[job].work();
          } catch (const std::bad_alloc&) {
            errors[job] = "out of memory";
          } catch (const std::exception& error) {
            errors[job] = error.what();
          }
        }
      },
      tbb::simple_partitioner());
  for (std::size_t job = 0; job < errors.size(); ++job)
    if (!errors[job].empty()) fail(m_jobs[job].where, "{}", errors[job]);
  m_jobs.clear();
}

TextureId LoadContext::add_texture(Texture texture) {
  scene.textures.push_back(std::move(texture));
  return static_cast<TextureId>(scene.textures.size() - 1);
}

BsdfId LoadContext::add_bsdf(Bsdf bsdf) {
  scene.bsdfs.push_back(std::move(bsdf));
  return static_cast<BsdfId>(scene.bsdfs.size() - 1);
}

Motion get_motion(const LoadContext& context, const Object& object, std::string_view name) {
  const Transform transform = object.get_transform(name);
  Motion motion;
  motion.matrix[0] = matrix_at(transform, context.shutter_open);
  motion.matrix[1] = matrix_at(transform, context.shutter_close);
  motion.moving = motion.matrix[0] != motion.matrix[1];
  return motion;
}

Imath::M44d get_still_transform(const Object& object, std::string_view name) {
  const Transform transform = object.get_transform(name);
  if (transform.size() > 1)
    fail(object.find(name)->where, "{} \"{}\" cannot be animated: only shapes and sensors can", object.tag,
         object.type);
  return transform[0].matrix;
}

Scene load_scene(const fs::path& file, const SceneOptions& options) {
  const XmlDocument document = read_scene_xml(file, options.defines);
  const ObjectTree tree = build_objects(document.root);
  for (const auto& object : tree.objects)
    if (object->tag == "medium" || object->tag == "phase" || object->tag == "volume")
      fail(object->where,
           "participating media are not supported yet (<{} type=\"{}\">); take it out to render the surfaces",
           object->tag, object->type);

  Scene scene;
  scene.file = file;
  LoadContext context(scene, options, document.folders);
  const Object& root = tree.scene();

  const auto take_first = [&](std::string_view tag) -> const Object* {
    const auto found = root.take_objects(tag);
    for (std::size_t i = 1; i < found.size(); ++i)
      log::warn("{}: only the first {} is used, at {}", to_string(found[i]->where), tag, to_string(found[0]->where));
    return found.empty() ? nullptr : std::get<const Object*>(found[0]->value);
  };
  const Object* sensor = take_first("sensor");
  if (!sensor) fail(root.where, "the scene has no <sensor>");
  load_sensor(context, *sensor);
  if (const Object* integrator = take_first("integrator")) load_integrator(context, *integrator);
  if (options.max_depth != 0) scene.integrator.max_depth = options.max_depth;

  for (const Property* bsdf : root.take_objects("bsdf")) load_bsdf(context, *std::get<const Object*>(bsdf->value));
  root.take_objects("texture");  // they are loaded where they are referred to, which tells what they are for
  for (const Property* shape : root.take_objects("shape")) load_shape(context, *std::get<const Object*>(shape->value));
  for (const Property* emitter : root.take_objects("emitter")) {
    const Object& object = *std::get<const Object*>(emitter->value);
    if (object.type == "area") {  // shines where shapes refer to it
      if (!context.attached_emitters.contains(&object))
        log::warn("{}: the area emitter belongs to no shape, so it does not shine", to_string(object.where));
      continue;
    }
    load_emitter(context, object);
  }
  root.check_all_read();
  context.run_jobs();

  for (const Shape& shape : scene.shapes)
    if (shape.emitter < 0 && shape.bsdf < 0) throw InternalError("a shape without a material");
  return scene;
}

}  // namespace warpath
