#include "core/tensor_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "core/file.h"
#include "warpath/error.h"

// The format: 8 bytes header length, little-endian; a JSON header of that length; then the tensors' bytes, without
// holes. https://huggingface.co/docs/safetensors, "Format"
namespace warpath {
namespace fs = std::filesystem;
using Json = nlohmann::json;

namespace {

static_assert(std::endian::native == std::endian::little, "safetensors are little-endian");

constexpr std::uint64_t kMaxHeader = 100'000'000;  // the reference implementation's limit

struct DType {
  std::string_view name;
  std::uint64_t size;
};
constexpr std::array<DType, 5> kDTypes{{{"F32", 4}, {"F64", 8}, {"I32", 4}, {"I64", 8}, {"U8", 1}}};

template <class T>
constexpr std::string_view kDTypeOf = "";
template <>
constexpr std::string_view kDTypeOf<float> = "F32";
template <>
constexpr std::string_view kDTypeOf<double> = "F64";
template <>
constexpr std::string_view kDTypeOf<std::int32_t> = "I32";
template <>
constexpr std::string_view kDTypeOf<std::int64_t> = "I64";
template <>
constexpr std::string_view kDTypeOf<std::uint8_t> = "U8";

std::optional<std::uint64_t> size_of(std::string_view dtype) {
  const auto found =
      std::find_if(kDTypes.begin(), kDTypes.end(), [&](const DType& type) { return type.name == dtype; });
  if (found == kDTypes.end()) return std::nullopt;
  return found->size;
}

/// Number of elements; nothing if it does not fit into 63 bits or a length is negative.
std::optional<std::uint64_t> element_count(std::span<const std::int64_t> shape) {
  std::uint64_t count = 1;
  for (const std::int64_t length : shape)
    if (length < 0 || __builtin_mul_overflow(count, static_cast<std::uint64_t>(length), &count)) return std::nullopt;
  if (count > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) return std::nullopt;
  return count;
}

/// Everything that is wrong with a file ends here.
[[noreturn]] void fail(const fs::path& path, std::string_view what) {
  throw FileError(fmt::format("{}: not a usable safetensors file: {}", path.string(), what));
}

/// The header as JSON: an object of objects, at most four levels deep, no name twice.
Json parse_header(const fs::path& path, const std::string& text) {
  std::vector<std::set<std::string>> names;  // of the objects that are open
  const auto check = [&](int depth, Json::parse_event_t event, Json& parsed) {
    if (depth > 4) fail(path, "its header is nested too deeply");
    if (event == Json::parse_event_t::object_start) names.emplace_back();
    if (event == Json::parse_event_t::object_end) names.pop_back();
    if (event == Json::parse_event_t::key && !names.back().insert(parsed.get<std::string>()).second)
      fail(path, fmt::format("its header has \"{}\" twice", parsed.get<std::string>()));
    return true;
  };
  Json header;
  try {
    header = Json::parse(text, check);
  } catch (const Json::exception& error) {
    fail(path, fmt::format("its header is not JSON ({})", error.what()));
  }
  if (!header.is_object()) fail(path, "its header is not a JSON object");
  return header;
}

struct Place {
  std::string name;
  std::uint64_t begin, end;  // bytes from the start of the data
};

/// One tensor of the header: its entry without bytes, and where those stand.
Place parse_tensor(const fs::path& path, const std::string& name, const Json& json, std::uint64_t data_size,
                   TensorFile::Entry& entry) {
  const auto bad = [&](std::string_view what) { fail(path, fmt::format("tensor \"{}\" {}", name, what)); };
  if (!json.is_object() || !json.contains("dtype") || !json.contains("shape") || !json.contains("data_offsets"))
    bad("lacks dtype, shape or data_offsets");
  if (!json["dtype"].is_string()) bad("has a dtype that is not a string");
  entry.dtype = json["dtype"].get<std::string>();
  const auto size = size_of(entry.dtype);
  if (!size) bad(fmt::format("is of type {}; known: F32, F64, I32, I64, U8", entry.dtype));
  if (!json["shape"].is_array()) bad("has a shape that is not an array");
  for (const Json& length : json["shape"]) {
    if (!length.is_number_unsigned() || length.get<std::uint64_t>() > std::numeric_limits<std::int64_t>::max())
      bad("has a length that is not a whole number");
    entry.shape.push_back(length.get<std::int64_t>());
  }
  const Json& offsets = json["data_offsets"];
  if (!offsets.is_array() || offsets.size() != 2 || !offsets[0].is_number_unsigned() ||
      !offsets[1].is_number_unsigned())
    bad("has data_offsets that are not two whole numbers");
  const Place place{name, offsets[0].get<std::uint64_t>(), offsets[1].get<std::uint64_t>()};
  if (place.begin > place.end || place.end > data_size)
    bad(fmt::format("has data_offsets [{}, {}] outside of the {} bytes of data", place.begin, place.end, data_size));
  const auto count = element_count(entry.shape);
  if (!count || *count > (place.end - place.begin) / *size || *count * *size != place.end - place.begin)
    bad(fmt::format("has {} bytes, not those of {} x {}", place.end - place.begin, entry.dtype,
                    fmt::join(entry.shape, " x ")));
  return place;
}

}  // namespace

template <class T>
void TensorFile::put(const std::string& name, std::vector<std::int64_t> shape, std::span<const T> values) {
  WARPATH_CHECK(name != "__metadata__");
  const auto count = element_count(shape);
  WARPATH_CHECK(count.has_value());
  WARPATH_CHECK_EQ(*count, values.size());
  Entry& entry = m_tensors[name];
  entry.dtype = kDTypeOf<T>;
  entry.shape = std::move(shape);
  entry.bytes.resize(values.size_bytes());
  if (!values.empty()) std::memcpy(entry.bytes.data(), values.data(), values.size_bytes());
}

template <class T>
TensorFile::Tensor<T> TensorFile::get(const std::string& name) const {
  const auto found = m_tensors.find(name);
  if (found == m_tensors.end()) throw FileError(fmt::format("{}: has no tensor \"{}\"", m_path.string(), name));
  const Entry& entry = found->second;
  if (entry.dtype != kDTypeOf<T>)
    throw FileError(
        fmt::format("{}: tensor \"{}\" is of type {}, not {}", m_path.string(), name, entry.dtype, kDTypeOf<T>));
  Tensor<T> tensor{entry.shape, std::vector<T>(entry.bytes.size() / sizeof(T))};
  if (!entry.bytes.empty()) std::memcpy(tensor.values.data(), entry.bytes.data(), entry.bytes.size());
  return tensor;
}

#define WARPATH_INSTANTIATE(T)                                                                         \
  template void TensorFile::put<T>(const std::string&, std::vector<std::int64_t>, std::span<const T>); \
  template TensorFile::Tensor<T> TensorFile::get<T>(const std::string&) const;
WARPATH_INSTANTIATE(float)
WARPATH_INSTANTIATE(double)
WARPATH_INSTANTIATE(std::int32_t)
WARPATH_INSTANTIATE(std::int64_t)
WARPATH_INSTANTIATE(std::uint8_t)
#undef WARPATH_INSTANTIATE

const std::string& TensorFile::meta(const std::string& key) const {
  const auto found = m_metadata.find(key);
  if (found == m_metadata.end()) throw FileError(fmt::format("{}: has no metadata \"{}\"", m_path.string(), key));
  return found->second;
}

TensorFile TensorFile::load(const fs::path& path) {
  TensorFile file;
  file.m_path = path;
  std::error_code error;
  if (!fs::exists(path, error)) throw FileError(fmt::format("{}: no such file", path.string()));
  if (!fs::is_regular_file(path, error)) throw FileError(fmt::format("{}: not a regular file", path.string()));
  const std::uint64_t file_size = fs::file_size(path, error);
  std::ifstream stream(path, std::ios::binary);
  if (error || !stream) throw FileError(fmt::format("{}: cannot be read", path.string()));
  const auto read = [&](void* to, std::uint64_t size) {
    if (!stream.read(static_cast<char*>(to), static_cast<std::streamsize>(size)))
      throw FileError(fmt::format("{}: cannot be read to its end", path.string()));
  };

  std::uint64_t header_size = 0;
  if (file_size < sizeof(header_size)) fail(path, fmt::format("it has only {} bytes", file_size));
  read(&header_size, sizeof(header_size));
  if (header_size > std::min(kMaxHeader, file_size - sizeof(header_size)))
    fail(path, fmt::format("its header would have {} bytes, the file has {}", header_size, file_size));
  std::string text(header_size, '\0');
  read(text.data(), header_size);
  const Json header = parse_header(path, text);

  const std::uint64_t data_size = file_size - sizeof(header_size) - header_size;
  std::vector<Place> places;
  for (const auto& [name, json] : header.items()) {
    if (name == "__metadata__") {
      if (!json.is_object()) fail(path, "its __metadata__ is not an object");
      for (const auto& [key, value] : json.items()) {
        if (!value.is_string()) fail(path, fmt::format("metadata \"{}\" is not a string", key));
        file.m_metadata[key] = value.get<std::string>();
      }
    } else {
      places.push_back(parse_tensor(path, name, json, data_size, file.m_tensors[name]));
    }
  }
  // Only now is it known that the tensors tile the data, so all of them together need no more memory than the file has.
  std::sort(places.begin(), places.end(),
            [](const Place& a, const Place& b) { return std::pair(a.begin, a.end) < std::pair(b.begin, b.end); });
  std::uint64_t expected = 0;
  for (const Place& place : places) {
    if (place.begin != expected)
      fail(path,
           fmt::format("tensor \"{}\" begins at byte {} of the data, not at {}", place.name, place.begin, expected));
    expected = place.end;
  }
  if (expected != data_size) fail(path, fmt::format("{} bytes follow its last tensor", data_size - expected));
  for (const Place& place : places) {
    std::vector<std::uint8_t>& bytes = file.m_tensors[place.name].bytes;
    bytes.resize(place.end - place.begin);
    if (!bytes.empty()) read(bytes.data(), bytes.size());
  }
  return file;
}

void TensorFile::save(const fs::path& path) const {
  // Wide elements first, so that with a padded header every tensor is aligned in a memory-mapped file.
  std::vector<const std::pair<const std::string, Entry>*> order;
  for (const auto& tensor : m_tensors) order.push_back(&tensor);
  std::stable_sort(order.begin(), order.end(),
                   [](const auto* a, const auto* b) { return *size_of(a->second.dtype) > *size_of(b->second.dtype); });
  Json header = Json::object();
  if (!m_metadata.empty()) header["__metadata__"] = m_metadata;
  std::uint64_t offset = 0;
  for (const auto* tensor : order) {
    const Entry& entry = tensor->second;
    header[tensor->first] = {
        {"dtype", entry.dtype}, {"shape", entry.shape}, {"data_offsets", {offset, offset + entry.bytes.size()}}};
    offset += entry.bytes.size();
  }
  std::string text = header.dump(-1, ' ', false, Json::error_handler_t::replace);  // paths need not be UTF-8
  text.resize((text.size() + 7) / 8 * 8, ' ');
  const std::uint64_t header_size = text.size();

  write_atomically(path, [&](const fs::path& temporary) {
    std::ofstream stream(temporary, std::ios::binary);
    stream.write(reinterpret_cast<const char*>(&header_size), sizeof(header_size));
    stream.write(text.data(), static_cast<std::streamsize>(text.size()));
    for (const auto* tensor : order)
      stream.write(reinterpret_cast<const char*>(tensor->second.bytes.data()),
                   static_cast<std::streamsize>(tensor->second.bytes.size()));
    stream.close();
    if (!stream) throw FileError(fmt::format("{}: cannot write: {}", path.string(), std::strerror(errno)));
  });
}

}  // namespace warpath
