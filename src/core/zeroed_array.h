#pragma once
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>

namespace warpath {

/// An array of plain numbers that starts as zeros and costs memory only where it is written to: the system gives pages
/// when they are touched. For large arrays of which most may stay empty.
template <class T>
class ZeroedArray {
 public:
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);
  explicit ZeroedArray(std::size_t size) : m_size(size), m_values(static_cast<T*>(std::calloc(size, sizeof(T)))) {
    if (!m_values && size > 0) throw std::bad_alloc();
  }
  std::size_t size() const { return m_size; }
  T& operator[](std::size_t i) { return m_values[i]; }
  const T& operator[](std::size_t i) const { return m_values[i]; }

 private:
  struct Free {
    void operator()(T* values) const { std::free(values); }
  };
  std::size_t m_size;
  std::unique_ptr<T[], Free> m_values;
};

}  // namespace warpath
