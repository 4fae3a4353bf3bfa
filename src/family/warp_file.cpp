#include "family/warp_file.h"

#include "core/tensor_file.h"
#include "family/family.h"
#include "warpath/error.h"

namespace warpath {
namespace {

// The metadata of a file: `format`, `family`, `dims`, `layout`, `scene`, `setting.*`; the proposal's own stands under
// `warp.`, and `family` repeats the one that was trained, for people who look into the file.
constexpr std::string_view kFormat = "warpath 1";
const std::string kPrefix = "warp.";
const std::string kSetting = "setting.";

}  // namespace

std::string family_of(const WarpFile& file) {
  return file.proposal ? file.proposal->family() : file.vertex_proposal->family();
}

void save_warp(const std::filesystem::path& path, const WarpFile& file) {
  WARPATH_CHECK((file.proposal != nullptr) != (file.vertex_proposal != nullptr));
  TensorFile tensors;
  if (file.proposal) {
    WARPATH_CHECK_EQ(file.proposal->dims(), file.layout.dims());
    file.proposal->save(tensors, kPrefix);
  } else {
    file.vertex_proposal->save(tensors, kPrefix);
  }
  tensors.metadata()["format"] = kFormat;
  tensors.metadata()["family"] = family_of(file);
  tensors.metadata()["dims"] = std::to_string(file.layout.dims());
  tensors.metadata()["layout"] = file.layout.name();
  tensors.metadata()["scene"] = file.scene;
  for (const auto& [name, value] : file.settings) tensors.metadata()[kSetting + name] = value;
  tensors.save(path);
}

WarpFile load_warp(const std::filesystem::path& path) {
  const TensorFile tensors = TensorFile::load(path);
  if (const std::string& format = tensors.meta("format"); format != kFormat)
    throw FileError(
        fmt::format("{}: format \"{}\"; this version of warpath reads \"{}\"", path.string(), format, kFormat));
  WarpFile file;
  const Family* family = find_family(tensors.meta(kPrefix + "family"));
  if (family && family->at_vertices()) {
    file.vertex_proposal = family->at_vertices()->load(tensors, kPrefix);
    file.layout = file.vertex_proposal->numbers();
  } else {
    try {
      file.layout = Layout::parse(tensors.meta("layout"));
    } catch (const ConfigError& error) {
      throw FileError(fmt::format("{}: layout: {}", path.string(), error.what()));
    }
    file.proposal = load_proposal(tensors, kPrefix);
    if (file.proposal->dims() != file.layout.dims())
      throw FileError(fmt::format("{}: its warp has {} dimensions, its layout \"{}\" {}", path.string(),
                                  file.proposal->dims(), file.layout.name(), file.layout.dims()));
  }
  file.scene = tensors.meta("scene");
  for (const auto& [name, value] : tensors.metadata())
    if (name.starts_with(kSetting)) file.settings[name.substr(kSetting.size())] = value;
  return file;
}

}  // namespace warpath
