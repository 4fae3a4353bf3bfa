#include <algorithm>
#include <cmath>
#include <cstring>

#include "scene/mesh_file.h"

namespace warpath {
namespace {

struct Corner {
  std::uint32_t position = kNoIndex, uv = kNoIndex, normal = kNoIndex;
};

bool is_blank(char c) { return c == ' ' || c == '\t'; }
bool is_line_end(char c) { return c == '\n' || c == '\r' || c == '\0' || c == '#'; }

class ObjParser {
 public:
  ObjParser(const std::filesystem::path& file, bool flip_v)
      : m_file(file), m_flip_v(flip_v), m_bytes(read_bytes(file)) {}
  IndexedMesh parse();

 private:
  template <class... Args>
  [[noreturn]] void fail(const char* at, fmt::format_string<Args...> text, Args&&... args) const {
    const auto line = std::count(m_bytes.begin(), std::min(at, m_bytes.end()), '\n') + 1;
    throw MeshError(fmt::format("{}:{}: {}", m_file.string(), line, fmt::format(text, std::forward<Args>(args)...)));
  }
  const char* parse_numbers(const char* p, float* values, int wanted, int least, const char* what) const;
  const char* parse_index(const char* p, std::size_t count, const char* what, std::uint32_t& index) const;
  const char* parse_face(const char* p);

  const std::filesystem::path& m_file;
  bool m_flip_v;
  FileBytes m_bytes;
  IndexedMesh m_mesh;
};

const char* ObjParser::parse_numbers(const char* p, float* values, int wanted, int least, const char* what) const {
  for (int i = 0; i < wanted; ++i) {
    const char* next = parse_float(p, values[i]);
    if (!next) {
      if (i >= least) return p;
      fail(p, "a {} needs {} numbers", what, least);
    }
    if (!std::isfinite(values[i])) fail(p, "a {} has a number that is not finite", what);
    p = next;
  }
  return p;
}

/// Indices count from 1, or backwards from the last value so far: -1.
const char* ObjParser::parse_index(const char* p, std::size_t count, const char* what, std::uint32_t& index) const {
  const bool backwards = *p == '-';
  const char* const digits = p += backwards;
  std::uint64_t value = 0;
  for (; static_cast<unsigned char>(*p - '0') < 10 && value < (1ull << 40); ++p)
    value = value * 10 + static_cast<unsigned>(*p - '0');
  if (p == digits) fail(p, "a face needs indices like 1, 1/2, 1//3 or 1/2/3");
  if (value == 0 || value > count)
    fail(p, "a face refers to {} {}{}, but there are only {} before it", what, backwards ? "-" : "", value, count);
  index = static_cast<std::uint32_t>(backwards ? count - value : value - 1);
  return p;
}

const char* ObjParser::parse_face(const char* p) {
  Corner first, previous;
  for (int corners = 0;; ++corners) {
    while (is_blank(*p)) ++p;
    if (is_line_end(*p)) return p;
    Corner corner;
    p = parse_index(p, m_mesh.positions.size(), "vertex", corner.position);
    if (*p == '/') {
      if (*++p != '/' && !is_blank(*p) && !is_line_end(*p))
        p = parse_index(p, m_mesh.uvs.size(), "texture coordinate", corner.uv);
      if (*p == '/') {
        ++p;
        if (!is_blank(*p) && !is_line_end(*p)) p = parse_index(p, m_mesh.normals.size(), "normal", corner.normal);
      }
    }
    if (!is_blank(*p) && !is_line_end(*p)) fail(p, "unexpected \"{}\" in a face", *p);
    if (corners >= 2) {
      for (const Corner& c : {first, previous, corner}) {
        m_mesh.corner_position.push_back(c.position);
        m_mesh.corner_uv.push_back(c.uv);
        m_mesh.corner_normal.push_back(c.normal);
      }
    }
    (corners == 0 ? first : previous) = corner;
  }
}

IndexedMesh ObjParser::parse() {
  const char* p = m_bytes.begin();
  const char* const end = m_bytes.end();
  while (p < end) {
    while (is_blank(*p)) ++p;
    if (p[0] == 'v' && is_blank(p[1])) {
      Vec3 v;
      p = parse_numbers(p + 2, &v.x, 3, 3, "vertex");
      m_mesh.positions.push_back(v);
    } else if (p[0] == 'v' && p[1] == 'n' && is_blank(p[2])) {
      Vec3 n;
      p = parse_numbers(p + 3, &n.x, 3, 3, "normal");
      m_mesh.normals.push_back(n);
    } else if (p[0] == 'v' && p[1] == 't' && is_blank(p[2])) {
      Vec2 uv(0.0f);
      p = parse_numbers(p + 3, &uv.x, 2, 1, "texture coordinate");
      if (m_flip_v) uv.y = 1 - uv.y;
      m_mesh.uvs.push_back(uv);
    } else if (p[0] == 'f' && is_blank(p[1])) {
      p = parse_face(p + 2);
    }
    p = static_cast<const char*>(std::memchr(p, '\n', static_cast<std::size_t>(end - p) + 1)) + 1;
  }

  // Most files number all three alike; then a corner's vertex is its position's index.
  const auto tidy = [&](std::vector<std::uint32_t>& corners, auto& values) {
    const bool none = std::all_of(corners.begin(), corners.end(), [](std::uint32_t i) { return i == kNoIndex; });
    if (none) values.clear();
    if (none || (corners == m_mesh.corner_position && values.size() == m_mesh.positions.size())) corners = {};
  };
  tidy(m_mesh.corner_uv, m_mesh.uvs);
  tidy(m_mesh.corner_normal, m_mesh.normals);
  return std::move(m_mesh);
}

}  // namespace

IndexedMesh read_obj(const std::filesystem::path& file, bool flip_v) { return ObjParser(file, flip_v).parse(); }

}  // namespace warpath
