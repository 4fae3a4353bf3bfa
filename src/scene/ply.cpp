#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include "scene/mesh_file.h"

namespace warpath {
namespace {

enum class Type : std::uint8_t { i8, u8, i16, u16, i32, u32, f32, f64 };
enum class Format : std::uint8_t { ascii, little, big };

constexpr std::size_t size_of(Type type) {
  constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

struct PlyProperty {
  std::string name;
  Type type = Type::f32;
  std::optional<Type> list_count;  // type of the count, if it is a list
  std::size_t offset = 0;          // in the record, if no list comes before it
};
struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
  std::size_t stride = 0;
  bool has_lists = false;

  int find(std::initializer_list<std::string_view> names) const {
    for (const auto wanted : names)
      for (std::size_t i = 0; i < properties.size(); ++i)
        if (properties[i].name == wanted) return static_cast<int>(i);
    return -1;
  }
};

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  constexpr std::string_view kBlanks = " \t\r";
  for (auto begin = line.find_first_not_of(kBlanks); begin != std::string_view::npos;) {
    const auto end = std::min(line.find_first_of(kBlanks, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(kBlanks, end);
  }
  return words;
}

class PlyParser {
 public:
  PlyParser(const std::filesystem::path& file, bool flip_v)
      : m_file(file), m_flip_v(flip_v), m_bytes(read_bytes(file)) {}
  IndexedMesh parse();

 private:
  template <class... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> text, Args&&... args) const {
    // Lines mean something in the header and in ascii files only.
    const std::string text_now = fmt::format(text, std::forward<Args>(args)...);
    if (m_in_header || m_format == Format::ascii) {
      const auto line = std::count(m_bytes.begin(), std::min(m_at, m_bytes.end()), '\n') + 1;
      throw MeshError(fmt::format("{}:{}: {}", m_file.string(), line, text_now));
    }
    throw MeshError(fmt::format("{}: {}", m_file.string(), text_now));
  }

  void parse_header();
  void parse_header_line(const std::vector<std::string_view>& words);
  Type parse_type(std::string_view name) const;
  void check_size(const Element& element) const;
  void parse_vertices(const Element& element);
  void parse_faces(const Element& element);
  void skip(const Element& element);
  double read_scalar(Type type);
  /// Reads one record; the first value of each list is skipped over unless `list` wants that property's values.
  void read_record(const Element& element, std::vector<double>& values, int list, std::vector<double>& list_values);

  const std::filesystem::path& m_file;
  bool m_flip_v;
  FileBytes m_bytes;
  const char* m_at = nullptr;
  bool m_in_header = true;
  Format m_format = Format::ascii;
  std::vector<Element> m_elements;
  IndexedMesh m_mesh;
};

Type PlyParser::parse_type(std::string_view name) const {
  struct Name {
    std::string_view name;
    Type type;
  };
  constexpr Name kNames[] = {
      {"char", Type::i8},   {"int8", Type::i8},     {"uchar", Type::u8},   {"uint8", Type::u8},
      {"short", Type::i16}, {"int16", Type::i16},   {"ushort", Type::u16}, {"uint16", Type::u16},
      {"int", Type::i32},   {"int32", Type::i32},   {"uint", Type::u32},   {"uint32", Type::u32},
      {"float", Type::f32}, {"float32", Type::f32}, {"double", Type::f64}, {"float64", Type::f64}};
  for (const Name& known : kNames)
    if (known.name == name) return known.type;
  fail("unknown type \"{}\"", name);
}

void PlyParser::parse_header_line(const std::vector<std::string_view>& words) {
  if (words.empty() || words[0] == "comment" || words[0] == "obj_info") return;
  if (words[0] == "format" && words.size() >= 2) {
    if (words[1] == "ascii")
      m_format = Format::ascii;
    else if (words[1] == "binary_little_endian")
      m_format = Format::little;
    else if (words[1] == "binary_big_endian")
      m_format = Format::big;
    else
      fail("unknown format \"{}\"", words[1]);
  } else if (words[0] == "element" && words.size() == 3) {
    Element element;
    element.name = words[1];
    for (const char c : words[2]) {
      if (c < '0' || c > '9' || element.count > (std::size_t{1} << 40)) fail("\"{}\" is no count", words[2]);
      element.count = element.count * 10 + static_cast<std::size_t>(c - '0');
    }
    m_elements.push_back(std::move(element));
  } else if (words[0] == "property" && !m_elements.empty() && words.size() >= 3) {
    PlyProperty property;
    Element& element = m_elements.back();
    if (words[1] == "list") {
      if (words.size() != 5) fail("a list property needs two types and a name");
      property.list_count = parse_type(words[2]);
      property.type = parse_type(words[3]);
      element.has_lists = true;
    } else {
      property.type = parse_type(words[1]);
      property.offset = element.stride;
      element.stride += size_of(property.type);
    }
    property.name = words.back();
    element.properties.push_back(std::move(property));
  } else {
    fail("unexpected \"{}\" in the header", words[0]);
  }
}

void PlyParser::parse_header() {
  m_at = m_bytes.begin();
  const auto next_line = [&]() -> std::string_view {
    if (m_at >= m_bytes.end()) fail("the header has no end_header");
    const char* end =
        static_cast<const char*>(std::memchr(m_at, '\n', static_cast<std::size_t>(m_bytes.end() - m_at) + 1));
    return {m_at, static_cast<std::size_t>(end - m_at)};
  };
  const std::string_view magic = next_line();
  if (magic.substr(0, 3) != "ply" || magic.size() > 4) fail("is no PLY file: it does not start with \"ply\"");
  m_at += magic.size() + 1;
  for (;;) {
    const std::string_view line = next_line();
    const auto words = words_of(line);
    if (words.size() == 1 && words[0] == "end_header") {
      m_at += line.size() + 1;
      break;
    }
    parse_header_line(words);
    m_at += line.size() + 1;
  }
  m_in_header = false;
}

double PlyParser::read_scalar(Type type) {
  if (m_format == Format::ascii) {
    while (*m_at == '\n' || *m_at == '\r') {
      if (m_at >= m_bytes.end()) fail("the file ends too early");
      ++m_at;
      while (*m_at == ' ' || *m_at == '\t') ++m_at;
    }
    float value = 0;
    if (type != Type::f32 && type != Type::f64) {  // indices above 2^24 are no floats
      while (*m_at == ' ' || *m_at == '\t') ++m_at;
      char* end = nullptr;
      const long long integer = std::strtoll(m_at, &end, 10);
      if (end != m_at && *end != '.' && *end != 'e') {
        m_at = end;
        return static_cast<double>(integer);
      }
    }
    const char* end = parse_float(m_at, value);
    if (!end) {
      while (*m_at == ' ' || *m_at == '\t' || *m_at == '\r') ++m_at;
      if (*m_at == '\n') return read_scalar(type);
      fail("expected a number");
    }
    m_at = end;
    return value;
  }
  const std::size_t size = size_of(type);
  if (static_cast<std::size_t>(m_bytes.end() - m_at) < size) fail("the file ends too early");
  unsigned char raw[8] = {};
  for (std::size_t i = 0; i < 8 && i < size; ++i)
    raw[i] = static_cast<unsigned char>(m_at[m_format == Format::big ? size - 1 - i : i]);
  m_at += size;
  const auto as = [&](auto value) {
    std::memcpy(&value, raw, sizeof value);
    return static_cast<double>(value);
  };
  switch (type) {
    case Type::i8:
      return as(std::int8_t{});
    case Type::u8:
      return as(std::uint8_t{});
    case Type::i16:
      return as(std::int16_t{});
    case Type::u16:
      return as(std::uint16_t{});
    case Type::i32:
      return as(std::int32_t{});
    case Type::u32:
      return as(std::uint32_t{});
    case Type::f32:
      return as(float{});
    case Type::f64:
      return as(double{});
  }
  return 0;
}

void PlyParser::read_record(const Element& element, std::vector<double>& values, int list,
                            std::vector<double>& list_values) {
  for (std::size_t i = 0; i < element.properties.size(); ++i) {
    const PlyProperty& property = element.properties[i];
    if (!property.list_count) {
      values[i] = read_scalar(property.type);
      continue;
    }
    const double count = read_scalar(*property.list_count);
    if (!(count >= 0 && count < 1e6)) fail("a list of {} values", count);
    if (static_cast<int>(i) == list) list_values.clear();
    for (int k = 0; k < static_cast<int>(count); ++k) {
      const double value = read_scalar(property.type);
      if (static_cast<int>(i) == list) list_values.push_back(value);
    }
  }
}

/// A count that the rest of the file cannot hold is found before memory is asked for.
void PlyParser::check_size(const Element& element) const {
  std::size_t least = 0;
  for (const PlyProperty& property : element.properties)
    least += m_format == Format::ascii ? 2 : size_of(property.list_count.value_or(property.type));
  const auto rest = static_cast<std::size_t>(m_bytes.end() - m_at) + 1;  // the last line may lack its line feed
  if (element.count >= kNoIndex || (least > 0 && element.count > rest / least))
    fail("the file ends too early: it announces {} of \"{}\"", element.count, element.name);
}

void PlyParser::parse_vertices(const Element& element) {
  const int position[3] = {element.find({"x"}), element.find({"y"}), element.find({"z"})};
  const int normal[3] = {element.find({"nx"}), element.find({"ny"}), element.find({"nz"})};
  const auto uv_pair = [&]() -> std::array<int, 2> {
    constexpr std::string_view kNames[][2] = {{"texture_u", "texture_v"}, {"s", "t"}, {"u", "v"}};
    for (const auto& [u, v] : kNames) {
      const int a = element.find({u}), b = element.find({v});
      if (a >= 0 && b >= 0) return {a, b};
    }
    return {-1, -1};
  }();
  for (const int p : position)
    if (p < 0) fail("the vertices lack x, y or z");
  const bool has_normals = normal[0] >= 0 && normal[1] >= 0 && normal[2] >= 0, has_uvs = uv_pair[0] >= 0;

  check_size(element);
  m_mesh.positions.resize(element.count);
  if (has_normals) m_mesh.normals.resize(element.count);
  if (has_uvs) m_mesh.uvs.resize(element.count);
  std::vector<double> values(element.properties.size()), unused;
  const auto value = [&](int property) { return static_cast<float>(values[static_cast<std::size_t>(property)]); };
  for (std::size_t i = 0; i < element.count; ++i) {
    read_record(element, values, -1, unused);
    const Vec3 p(value(position[0]), value(position[1]), value(position[2]));
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) fail("vertex {} is not finite", i);
    m_mesh.positions[i] = p;
    if (has_normals) m_mesh.normals[i] = Vec3(value(normal[0]), value(normal[1]), value(normal[2]));
    if (has_uvs) {
      const float v = value(uv_pair[1]);
      m_mesh.uvs[i] = Vec2(value(uv_pair[0]), m_flip_v ? 1 - v : v);
    }
  }
}

void PlyParser::parse_faces(const Element& element) {
  const int list = element.find({"vertex_index", "vertex_indices"});
  if (list < 0 || !element.properties[static_cast<std::size_t>(list)].list_count)
    fail("the faces lack the list vertex_indices");
  check_size(element);
  m_mesh.corner_position.reserve(3 * element.count);
  std::vector<double> values(element.properties.size()), polygon;
  for (std::size_t i = 0; i < element.count; ++i) {
    read_record(element, values, list, polygon);
    for (const double index : polygon)
      if (!(index >= 0 && index < static_cast<double>(m_mesh.positions.size())))
        fail("face {} refers to vertex {}, but there are {}", i, index, m_mesh.positions.size());
    for (std::size_t k = 2; k < polygon.size(); ++k)
      for (const double index : {polygon[0], polygon[k - 1], polygon[k]})
        m_mesh.corner_position.push_back(static_cast<std::uint32_t>(index));
  }
}

void PlyParser::skip(const Element& element) {
  check_size(element);
  std::vector<double> values(element.properties.size()), unused;
  for (std::size_t i = 0; i < element.count; ++i) read_record(element, values, -1, unused);
}

IndexedMesh PlyParser::parse() {
  parse_header();
  const auto has = [&](std::string_view name) {
    return std::any_of(m_elements.begin(), m_elements.end(), [&](const Element& e) { return e.name == name; });
  };
  if (!has("vertex") || !has("face")) fail("the file has no vertices or no faces");
  for (const Element& element : m_elements) {
    if (element.name == "vertex")
      parse_vertices(element);
    else if (element.name == "face")
      parse_faces(element);
    else
      skip(element);
  }
  return std::move(m_mesh);
}

}  // namespace

IndexedMesh read_ply(const std::filesystem::path& file, bool flip_v) { return PlyParser(file, flip_v).parse(); }

}  // namespace warpath
