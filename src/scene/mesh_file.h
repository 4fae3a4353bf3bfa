#pragma once
#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <vector>

#include "core/math.h"

namespace warpath {

/// A mesh file that cannot be read. The text starts with the file and, where it has lines, the line; the loader puts
/// the place in the scene file before it.
struct MeshError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline constexpr std::uint32_t kNoIndex = ~std::uint32_t{0};

/// Triangles as files have them, in object space: each corner has an index of its own into each array.
struct IndexedMesh {
  std::vector<Vec3> positions, normals;  ///< all positions are finite
  std::vector<Vec2> uvs;
  std::vector<std::uint32_t> corner_position;  ///< 3 per triangle, all in range
  /// Like corner_position, kNoIndex for none. Empty means that positions' indices hold (if there are values at all).
  std::vector<std::uint32_t> corner_normal, corner_uv;
};

/// Wavefront OBJ: v, vt, vn and polygons (fans around their first corner); everything else is skipped.
/// flip_v stores 1 - v, as Mitsuba does for OBJ by default.
IndexedMesh read_obj(const std::filesystem::path& file, bool flip_v);
/// Stanford PLY, ascii or binary of either byte order.
IndexedMesh read_ply(const std::filesystem::path& file, bool flip_v);

struct SerializedMesh {
  IndexedMesh mesh;
  bool face_normals = false;  ///< the file asks for them
};
/// Mitsuba's .serialized, versions 3, 4 and 5.
SerializedMesh read_serialized(const std::filesystem::path& file, int shape_index);

/// The bytes of a file with a line feed and a zero after them, so that parsers need not look for its end at each byte.
struct FileBytes {
  std::unique_ptr<char[]> data;
  std::size_t size = 0;
  const char* begin() const { return data.get(); }
  const char* end() const { return data.get() + size; }
};
FileBytes read_bytes(const std::filesystem::path& file);

/// Reads a number in text, correctly rounded; skips blanks before it. Null if there is none. The text must end in
/// something that is no part of a number.
const char* parse_float(const char* text, float& value);

}  // namespace warpath
