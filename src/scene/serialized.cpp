#include <zlib.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "scene/mesh_file.h"

namespace warpath {
namespace {

// The flag word. Versions 3 and 4 are Mitsuba 0.x's, version 5 is Mitsuba 3.9's.
constexpr std::uint32_t kHasNormals = 0x0001, kHasUvs = 0x0002, kHasColors = 0x0008, kFaceNormals = 0x0010,
                        kDoublePrecision = 0x2000;
constexpr std::uint32_t kV5HasNormals = 0x1, kV5HasTangents = 0x2, kV5HasUvs = 0x4;
constexpr std::uint16_t kMagic = 0x041c;

/// A zlib stream within a file, read piece by piece.
class Inflater {
 public:
  Inflater(const std::filesystem::path& file, const FileBytes& bytes, std::size_t offset)
      : m_file(file), m_bytes(bytes), m_offset(offset) {
    if (inflateInit(&m_stream) != Z_OK) throw std::bad_alloc();
  }
  ~Inflater() { inflateEnd(&m_stream); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  void read(void* target, std::size_t size);
  template <class T>
  T read() {
    T value;
    read(&value, sizeof value);
    return value;
  }
  template <class T>
  std::vector<T> read_array(std::size_t count) {
    std::vector<T> values(count);
    read(values.data(), count * sizeof(T));
    return values;
  }
  /// A count that the compressed bytes cannot hold is found before memory is asked for: deflate packs 1032 into one.
  void check_count(std::uint64_t count, std::size_t bytes_each) const {
    const std::uint64_t most = (m_bytes.size + 1) * 1032;
    if (count >= kNoIndex || count > most / bytes_each) fail("the file is broken: it announces {} values", count);
  }
  template <class... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> text, Args&&... args) const {
    throw MeshError(fmt::format("{}: {}", m_file.string(), fmt::format(text, std::forward<Args>(args)...)));
  }

 private:
  const std::filesystem::path& m_file;
  const FileBytes& m_bytes;
  std::size_t m_offset;
  z_stream m_stream{};
};

void Inflater::read(void* target, std::size_t size) {
  auto* out = static_cast<Bytef*>(target);
  while (size > 0) {
    constexpr std::size_t kPiece = std::numeric_limits<uInt>::max() / 2;
    if (m_stream.avail_in == 0) {
      m_stream.avail_in = static_cast<uInt>(std::min(m_bytes.size - m_offset, kPiece));
      m_stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(m_bytes.begin() + m_offset));
      m_offset += m_stream.avail_in;
    }
    m_stream.avail_out = static_cast<uInt>(std::min(size, kPiece));
    m_stream.next_out = out;
    const uInt wanted = m_stream.avail_out;
    const int status = inflate(&m_stream, Z_NO_FLUSH);
    const std::size_t got = wanted - m_stream.avail_out;
    out += got;
    size -= got;
    if (status == Z_DATA_ERROR || status == Z_NEED_DICT) fail("the compressed data are broken");
    if (size > 0 && (status == Z_STREAM_END || (got == 0 && m_stream.avail_in == 0))) fail("the file ends too early");
  }
}

/// N numbers for each vertex, in the file's precision.
template <int N>
std::vector<float> read_floats(Inflater& stream, std::size_t count, bool double_precision) {
  if (!double_precision) return stream.read_array<float>(count * N);
  const auto wide = stream.read_array<double>(count * N);
  return {wide.begin(), wide.end()};
}

std::vector<Vec3> vectors(const std::vector<float>& values) {
  std::vector<Vec3> result(values.size() / 3);
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = Vec3(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
  return result;
}

SerializedMesh read_legacy(Inflater& stream, int version) {
  const auto flags = stream.read<std::uint32_t>();
  if (version == 4)
    while (stream.read<char>() != 0) {
    }  // the name of the shape
  const auto vertices = stream.read<std::uint64_t>(), triangles = stream.read<std::uint64_t>();
  const bool wide = flags & kDoublePrecision;
  stream.check_count(vertices, wide ? 24 : 12);
  stream.check_count(triangles, 12);

  SerializedMesh result;
  result.face_normals = flags & kFaceNormals;
  result.mesh.positions = vectors(read_floats<3>(stream, vertices, wide));
  if (flags & kHasNormals) result.mesh.normals = vectors(read_floats<3>(stream, vertices, wide));
  if (flags & kHasUvs) {
    const auto uvs = read_floats<2>(stream, vertices, wide);
    for (std::size_t i = 0; i < vertices; ++i) result.mesh.uvs.emplace_back(uvs[2 * i], uvs[2 * i + 1]);
  }
  if (flags & kHasColors) read_floats<3>(stream, vertices, wide);
  result.mesh.corner_position = stream.read_array<std::uint32_t>(3 * triangles);
  return result;
}

/// The normal of a frame stored as a quaternion's stereographic projection.
Vec3 decode_normal(const Vec3& p) {
  const float scale = 1 / (1 + p.dot(p));
  const Vec3 i = p * (2 * scale);  // imaginary part
  const float r = 2 * scale - 1;   // real part
  return Vec3(2 * (i.x * i.z + r * i.y), 2 * (i.y * i.z - r * i.x), 1 - 2 * (i.x * i.x + i.y * i.y));
}

SerializedMesh read_version_5(Inflater& stream) {
  const auto flags = stream.read<std::uint32_t>();
  const auto name_length = stream.read<std::uint32_t>();
  stream.check_count(name_length, 1);
  stream.read_array<char>(name_length);
  const auto vertices = stream.read<std::uint64_t>(), triangles = stream.read<std::uint64_t>();
  stream.read<std::uint64_t>();  // surface points and normal groups: only edits of a mesh need them
  stream.read<std::uint64_t>();
  stream.check_count(vertices, 32);
  stream.check_count(triangles, 16);
  const auto records = stream.read_array<float>(8 * vertices);
  const auto faces = stream.read_array<std::uint32_t>(4 * triangles);

  SerializedMesh result;
  result.face_normals = flags & kFaceNormals;
  for (std::size_t v = 0; v < vertices; ++v) {
    const float* record = &records[8 * v];
    result.mesh.positions.emplace_back(record[0], record[1], record[2]);
    const Vec3 frame(record[3], record[4], record[5]);
    if (flags & kV5HasNormals) result.mesh.normals.push_back(flags & kV5HasTangents ? decode_normal(frame) : frame);
    if (flags & kV5HasUvs) result.mesh.uvs.emplace_back(record[6], record[7]);
  }
  result.mesh.corner_position.reserve(3 * triangles);
  for (std::size_t t = 0; t < triangles; ++t)
    result.mesh.corner_position.insert(result.mesh.corner_position.end(),
                                       {faces[4 * t], faces[4 * t + 1], faces[4 * t + 2]});

  return result;
}

template <class T>
T value_at(const FileBytes& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.begin() + offset, sizeof value);
  return value;
}

}  // namespace

SerializedMesh read_serialized(const std::filesystem::path& file, int shape_index) {
  const FileBytes bytes = read_bytes(file);
  const auto fail = [&](const std::string& text) -> MeshError {
    return MeshError(fmt::format("{}: {}", file.string(), text));
  };
  if (bytes.size < 8 || value_at<std::uint16_t>(bytes, 0) != kMagic) throw fail("is no Mitsuba .serialized file");
  const int version = value_at<std::uint16_t>(bytes, 2);
  if (version < 3 || version > 5) throw fail(fmt::format("version {} is not supported: only 3, 4 and 5 are", version));

  // The file ends in a table of where its meshes start (32 bits each in version 3) and their number.
  std::size_t start = 0;
  if (shape_index > 0) {
    const std::size_t width = version == 3 ? 4 : 8, count = value_at<std::uint32_t>(bytes, bytes.size - 4);
    if (static_cast<std::size_t>(shape_index) >= count)
      throw fail(fmt::format("shape_index is {}, but the file has {} meshes, from 0", shape_index, count));
    if (count * width + 4 > bytes.size) throw fail("the table of meshes at its end is broken");
    const std::size_t entry = bytes.size - 4 - width * (count - static_cast<std::size_t>(shape_index));
    start = version == 3 ? value_at<std::uint32_t>(bytes, entry) : value_at<std::uint64_t>(bytes, entry);
    if (start > bytes.size - 4) throw fail("the table of meshes at its end is broken");
  }
  Inflater stream(file, bytes, start + 4);
  SerializedMesh result = version == 5 ? read_version_5(stream) : read_legacy(stream, version);

  for (const Vec3& p : result.mesh.positions)
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) throw fail("a vertex is not finite");
  for (std::size_t i = 0; i < result.mesh.corner_position.size(); ++i)
    if (result.mesh.corner_position[i] >= result.mesh.positions.size())
      throw fail(fmt::format("triangle {} refers to vertex {}, but there are {}", i / 3, result.mesh.corner_position[i],
                             result.mesh.positions.size()));
  return result;
}

}  // namespace warpath
