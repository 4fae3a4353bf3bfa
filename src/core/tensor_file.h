#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace warpath {

/// Tensors by name and a `__metadata__` of strings: the safetensors format, little-endian.
class TensorFile {
 public:
  template <class T>  // float, double, std::int32_t, std::int64_t, std::uint8_t
  struct Tensor {
    std::vector<std::int64_t> shape;
    std::vector<T> values;
  };

  template <class T>
  void put(const std::string& name, std::vector<std::int64_t> shape, std::span<const T> values);
  /// Throws FileError that names the file and the tensor if it is missing or of another type.
  template <class T>
  Tensor<T> get(const std::string& name) const;
  bool has(const std::string& name) const { return m_tensors.contains(name); }

  std::map<std::string, std::string>& metadata() { return m_metadata; }
  const std::map<std::string, std::string>& metadata() const { return m_metadata; }
  /// A metadata entry; throws FileError that names the file and the key if it is missing.
  const std::string& meta(const std::string& key) const;

  struct Entry {
    std::string dtype;  ///< F32, F64, I32, I64, U8
    std::vector<std::int64_t> shape;
    std::vector<std::uint8_t> bytes;
  };
  const std::map<std::string, Entry>& entries() const { return m_tensors; }
  const std::filesystem::path& path() const { return m_path; }  ///< that it was loaded from; empty if it was not

  /// Throws FileError on anything that is not a whole, well-formed file (sizes are checked before anything is
  /// allocated).
  static TensorFile load(const std::filesystem::path& path);
  void save(const std::filesystem::path& path) const;  ///< atomically

 private:
  std::filesystem::path m_path;
  std::map<std::string, Entry> m_tensors;
  std::map<std::string, std::string> m_metadata;
};

}  // namespace warpath
