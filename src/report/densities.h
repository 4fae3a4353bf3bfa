#pragma once
#include <filesystem>
#include <vector>

#include "report/html.h"

namespace warpath {

/// Pictures of densities in a file of their own, so that a comparison that is resumed can show them again. Written
/// whole or not at all; throws FileError.
void write_densities(const std::filesystem::path& path, const std::vector<DensityPicture>& pictures);
/// Reads them back; none if there is no such file. Throws FileError if it is broken.
std::vector<DensityPicture> read_densities(const std::filesystem::path& path);

}  // namespace warpath
