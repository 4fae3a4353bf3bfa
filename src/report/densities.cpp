#include "report/densities.h"

#include <fstream>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "warpath/error.h"

namespace warpath {

using Json = nlohmann::ordered_json;

static void to_json(Json& json, const DensityGrid& grid) {
  json = {{"width", grid.width}, {"height", grid.height}, {"values", grid.values}};
}

static void from_json(const Json& json, DensityGrid& grid) {
  json.at("width").get_to(grid.width);
  json.at("height").get_to(grid.height);
  json.at("values").get_to(grid.values);
}

static void to_json(Json& json, const DensityPicture& picture) {
  json = {{"method", picture.method}, {"x_dimension", picture.x_dimension}, {"y_dimension", picture.y_dimension},
          {"slice", picture.slice},   {"learned", picture.learned},         {"candidates", picture.candidates}};
}

static void from_json(const Json& json, DensityPicture& picture) {
  json.at("method").get_to(picture.method);
  json.at("x_dimension").get_to(picture.x_dimension);
  json.at("y_dimension").get_to(picture.y_dimension);
  json.at("slice").get_to(picture.slice);
  json.at("learned").get_to(picture.learned);
  json.at("candidates").get_to(picture.candidates);
}

void write_densities(const std::filesystem::path& path, const std::vector<DensityPicture>& pictures) {
  write_atomically(path, Json(pictures).dump(-1, ' ', false, Json::error_handler_t::replace));
}

std::vector<DensityPicture> read_densities(const std::filesystem::path& path) {
  std::ifstream stream(path);
  if (!stream) return {};
  try {
    return Json::parse(stream).get<std::vector<DensityPicture>>();
  } catch (const Json::exception& error) {
    throw FileError(fmt::format("{}: {}", path.string(), error.what()));
  }
}

}  // namespace warpath
