#include <algorithm>
#include <cmath>
#include <limits>

#include "core/log.h"
#include "scene/loader.h"

namespace warpath {
namespace {

constexpr int kMostPixels = 1 << 20;  // a side of the film

const Object& only_one(const std::vector<const Property*>& found) {
  if (found.size() > 1)
    fail(found[1]->where, "a second {}; the first is at {}", std::get<const Object*>(found[1]->value)->tag,
         to_string(found[0]->where));
  return *std::get<const Object*>(found[0]->value);
}

ReconstructionFilter load_filter(const Object& object) {
  ReconstructionFilter filter;
  using Type = ReconstructionFilter::Type;
  if (object.type == "box") {
    filter.type = Type::box;
    filter.radius = 0.5f;
  } else if (object.type == "tent") {
    filter.type = Type::tent;
    filter.radius = object.get_float("radius", 1);
    if (!(filter.radius > 0)) fail(object.find("radius")->where, "\"radius\" must be greater than 0");
  } else if (object.type == "gaussian") {
    filter.type = Type::gaussian;
    filter.stddev = object.get_float("stddev", 0.5f);
    if (!(filter.stddev > 0)) fail(object.find("stddev")->where, "\"stddev\" must be greater than 0");
    filter.radius = 4 * filter.stddev;
  } else if (object.type == "mitchell") {
    filter.type = Type::mitchell;
    filter.radius = 2;
    filter.b = object.get_float("B", 1 / 3.0f);
    filter.c = object.get_float("C", 1 / 3.0f);
  } else if (object.type == "lanczos" || object.type == "catmullrom") {
    fail(object.where, "the rfilter \"{}\" is not supported; \"mitchell\" is as sharp, with less ringing", object.type);
  } else {
    constexpr std::string_view kKnown[] = {"box", "tent", "gaussian", "mitchell"};
    fail(object.where, "unknown rfilter \"{}\";{}", object.type, suggestion(object.type, kKnown));
  }
  object.check_all_read();
  return filter;
}

/// The crop window, scaled along when the size of the film is not the file's.
void set_crop(const Object& object, int file_size, int size, std::string_view axis, int& offset, int& crop) {
  const std::string size_name = axis == "x" ? "crop_width" : "crop_height",
                    offset_name = fmt::format("crop_offset_{}", axis);
  const int file_offset = static_cast<int>(object.get_integer(offset_name, 0, 0, kMostPixels));
  const int file_crop = static_cast<int>(object.get_integer(size_name, file_size, 1, kMostPixels));
  if (file_offset + file_crop > file_size) {
    const Property* at = object.find(object.has(size_name) ? size_name : offset_name);
    fail(at->where, "the crop window ends at {} = {}, beyond the film's {}", axis, file_offset + file_crop, file_size);
  }
  const double scale = static_cast<double>(size) / file_size;
  offset = std::min(static_cast<int>(std::lround(file_offset * scale)), size - 1);
  crop = std::clamp(static_cast<int>(std::lround((file_offset + file_crop) * scale)) - offset, 1, size - offset);
}

void load_film(LoadContext& context, const Object& object) {
  FilmSettings& film = context.scene.film;
  if (object.type != "hdrfilm")
    fail(object.where, "the film \"{}\" is not supported; use \"hdrfilm\" (its output goes where -o says)",
         object.type);
  const int width = static_cast<int>(object.get_integer("width", 768, 1, kMostPixels));
  const int height = static_cast<int>(object.get_integer("height", 576, 1, kMostPixels));
  film.width = context.options.width > 0 ? context.options.width : width;
  film.height = context.options.height > 0 ? context.options.height : height;
  set_crop(object, width, film.width, "x", film.crop_x, film.crop_width);
  set_crop(object, height, film.height, "y", film.crop_y, film.crop_height);
  // How the file is written is the command line's business.
  object.ignore({"file_format", "pixel_format", "component_format", "banner", "compensate"});
  if (object.get_boolean("sample_border", false))
    log::warn("{}: \"sample_border\" is ignored: pixels at the border see only samples within the film",
              to_string(object.find("sample_border")->where));
  if (const auto filters = object.take_objects("rfilter"); !filters.empty())
    film.filter = load_filter(only_one(filters));
  object.check_all_read();
}

void load_sampler(LoadContext& context, const Object& object) {
  constexpr std::string_view kKnown[] = {"independent", "stratified", "multijitter", "orthogonal", "ldsampler"};
  if (std::find(std::begin(kKnown), std::end(kKnown), object.type) == std::end(kKnown))
    fail(object.where, "unknown sampler \"{}\";{}", object.type, suggestion(object.type, kKnown));
  context.scene.sample_count =
      static_cast<int>(object.get_integer("sample_count", 4, 1, std::numeric_limits<int>::max()));
  object.ignore({"seed", "jitter", "strength"});  // warpath brings its own numbers
  object.check_all_read();
}

double to_degrees(double radians) { return radians * 180 / M_PI; }
double to_radians(double degrees) { return degrees * M_PI / 180; }

/// The field of view across the film's width, of `fov` on its axis or of a focal length on 35 mm film.
double get_x_fov(const Object& object, double aspect) {
  const Property* given = object.find("fov");
  double fov = 0;
  std::string axis;
  if (given) {
    if (object.has("focal_length")) fail(object.find("focal_length")->where, "give either \"fov\" or \"focal_length\"");
    fov = object.get_float("fov", 0);
    axis = object.get_choice("fov_axis", "x", {"x", "y", "diagonal", "smaller", "larger"});
    if (axis == "smaller") axis = aspect > 1 ? "y" : "x";
    if (axis == "larger") axis = aspect > 1 ? "x" : "y";
  } else {
    object.ignore({"fov_axis"});
    given = object.find("focal_length");
    std::string text = object.get_string("focal_length", "50mm");
    if (text.ends_with("mm")) text.resize(text.size() - 2);
    const double length = given ? parse_number(text, given->where) : 50;
    if (!(length > 0)) fail(given->where, "\"focal_length\" must be greater than 0");
    fov = to_degrees(2 * std::atan(std::hypot(36.0, 24.0) / (2 * length)));
    axis = "diagonal";
  }
  double result = fov;
  if (axis == "y") result = to_degrees(2 * std::atan(std::tan(to_radians(fov) / 2) * aspect));
  if (axis == "diagonal")
    result = to_degrees(2 * std::atan(std::tan(to_radians(fov) / 2) / std::sqrt(1 + 1 / (aspect * aspect))));
  if (!(fov > 0 && fov < 180 && result > 0 && result < 180))
    fail(given ? given->where : object.where, "the field of view must be between 0 and 180 degrees, not {}", fov);
  return result;
}

/// Mitsuba refuses cameras that scale. A uniform scale changes nothing that they see, so it is taken out.
Matrix4 without_scale(const Matrix4& matrix, const Location& where) {
  Imath::M44d m(matrix);
  const Imath::V3d rows[3] = {{m[0][0], m[0][1], m[0][2]}, {m[1][0], m[1][1], m[1][2]}, {m[2][0], m[2][1], m[2][2]}};
  const double scale = std::cbrt(std::abs(rows[0].dot(rows[1].cross(rows[2]))));
  if (!(scale > 0)) fail(where, "the sensor's to_world is singular");
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j)
      if (std::abs(rows[i].dot(rows[j]) / (scale * scale) - (i == j ? 1 : 0)) > 1e-3)
        fail(where, "the sensor's to_world shears or scales unevenly; it may turn, move and mirror");
  if (std::abs(scale * scale - 1) <= 1e-3) return matrix;
  log::warn("{}: the sensor's to_world scales by {:.4g}, which is ignored", to_string(where), scale);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) m[i][j] /= scale;
  return to_single(m);
}

}  // namespace

void load_sensor(LoadContext& context, const Object& object) {
  constexpr std::string_view kKnown[] = {"perspective", "thinlens"};
  if (std::find(std::begin(kKnown), std::end(kKnown), object.type) == std::end(kKnown))
    fail(object.where, "the sensor \"{}\" is not supported;{}", object.type, suggestion(object.type, kKnown));
  if (const auto films = object.take_objects("film"); !films.empty()) {
    load_film(context, only_one(films));
  } else {
    load_film(context, [] {
      Object standard;
      standard.tag = "film";
      standard.type = "hdrfilm";
      return standard;
    }());
  }
  context.scene.sample_count = 4;
  if (const auto samplers = object.take_objects("sampler"); !samplers.empty())
    load_sampler(context, only_one(samplers));

  Sensor& sensor = context.scene.sensor;
  const FilmSettings& film = context.scene.film;
  sensor.shutter_open = object.get_float("shutter_open", 0);
  sensor.shutter_close = object.get_float("shutter_close", 0);
  if (sensor.shutter_close < sensor.shutter_open)
    fail(object.where, "the shutter closes ({}) before it opens ({})", sensor.shutter_close, sensor.shutter_open);
  context.shutter_open = sensor.shutter_open;
  context.shutter_close = sensor.shutter_close;

  const Property* placed = object.find("to_world");
  const Motion motion = get_motion(context, object, "to_world");
  for (int i = 0; i < 2; ++i)
    sensor.to_world[i] = without_scale(motion.matrix[i], placed ? placed->where : object.where);
  sensor.x_fov = static_cast<float>(get_x_fov(object, static_cast<double>(film.width) / film.height));
  sensor.near_clip = object.get_float("near_clip", 1e-2f);
  sensor.far_clip = object.get_float("far_clip", 1e4f);
  if (!(sensor.near_clip > 0 && sensor.near_clip < sensor.far_clip))
    fail(object.where, "near_clip must be greater than 0 and less than far_clip: {}, {}", sensor.near_clip,
         sensor.far_clip);
  sensor.focus_distance = object.get_float("focus_distance", sensor.far_clip);
  if (object.type == "thinlens") {
    sensor.aperture_radius = object.require_float("aperture_radius");
    if (sensor.aperture_radius < 0)
      fail(object.find("aperture_radius")->where, "\"aperture_radius\" must not be negative");
    if (!(sensor.focus_distance > 0))
      fail(object.find("focus_distance")->where, "\"focus_distance\" must be greater than 0");
  } else {
    sensor.principal_x = object.get_float("principal_point_offset_x", 0);
    sensor.principal_y = object.get_float("principal_point_offset_y", 0);
  }
  object.check_all_read();
}

void load_integrator(LoadContext& context, const Object& object) {
  constexpr std::string_view kKnown[] = {"path", "direct", "volpath"};
  if (std::find(std::begin(kKnown), std::end(kKnown), object.type) == std::end(kKnown)) {
    if (object.type == "aov")
      fail(object.where,
           "the integrator \"aov\" is not supported; use \"path\" in its place, and --aov albedo,normal,depth");
    fail(object.where, "the integrator \"{}\" is not supported;{}", object.type, suggestion(object.type, kKnown));
  }
  IntegratorSettings& settings = context.scene.integrator;
  settings.hide_emitters = object.get_boolean("hide_emitters", false);
  object.ignore({"block_size", "samples_per_pass", "timeout"});
  if (object.type == "direct") {
    settings.max_depth = 2;
    for (const char* name : {"shading_samples", "emitter_samples", "bsdf_samples"})
      if (object.get_integer(name, 1, 0, 1 << 20) != 1)
        log::warn("{}: \"{}\" is ignored: one sample of the emitters and one of the BSDF are combined",
                  to_string(object.find(name)->where), name);
  } else {
    settings.max_depth = static_cast<int>(object.get_integer("max_depth", -1, -1, std::numeric_limits<int>::max()));
    settings.rr_depth = static_cast<int>(object.get_integer("rr_depth", 5, 1, std::numeric_limits<int>::max()));
  }
  object.check_all_read();
}

}  // namespace warpath
