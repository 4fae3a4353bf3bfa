#pragma once
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
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
  explicit ZeroedArray(std::size_t size)
      : m_size(size), m_memory(std::calloc(size * sizeof(T) + alignof(T), 1)), m_values(aligned(m_memory.get())) {
    if (!m_memory) throw std::bad_alloc();
  }
  std::size_t size() const { return m_size; }
  T& operator[](std::size_t i) { return m_values[i]; }
  const T& operator[](std::size_t i) const { return m_values[i]; }
  /// Entries [begin, end) are not needed any more: the system takes their pages back.
  void give_back(std::size_t begin, std::size_t end) {
    const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
    const auto first = (reinterpret_cast<std::uintptr_t>(m_values + begin) + page - 1) / page * page;
    const auto last = reinterpret_cast<std::uintptr_t>(m_values + end) / page * page;
    if (first < last) madvise(reinterpret_cast<void*>(first), last - first, MADV_DONTNEED);
  }

 private:
  struct Free {
    void operator()(void* memory) const { std::free(memory); }
  };
  /// calloc knows nothing of types that want more than 16 bytes.
  static T* aligned(void* memory) {
    const auto address = reinterpret_cast<std::uintptr_t>(memory);
    return reinterpret_cast<T*>((address + alignof(T) - 1) / alignof(T) * alignof(T));
  }
  std::size_t m_size;
  std::unique_ptr<void, Free> m_memory;
  T* m_values;
};

}  // namespace warpath
