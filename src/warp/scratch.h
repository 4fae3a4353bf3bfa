#pragma once
#include <cstddef>
#include <memory>
#include <vector>

namespace warpath {

/// Numbers that live as long as one call. A thread keeps its buffers, so that nothing is allocated once they have
/// grown; a call inside a call (a proposal within a proposal, or a task stolen while waiting) gets a buffer of its own.
template <class T>
class Scratch {
 public:
  explicit Scratch(std::size_t size) {
    if (pool().empty()) {
      m_buffer = std::make_unique<std::vector<T>>();
    } else {
      m_buffer = std::move(pool().back());
      pool().pop_back();
    }
    if (m_buffer->size() < size) m_buffer->resize(size);
  }
  ~Scratch() { pool().push_back(std::move(m_buffer)); }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  T* data() const { return m_buffer->data(); }  ///< at least `size` elements, with whatever was in them
  T& operator[](std::size_t i) const { return (*m_buffer)[i]; }

 private:
  using Pool = std::vector<std::unique_ptr<std::vector<T>>>;
  static Pool& pool() {
    static thread_local Pool buffers;
    return buffers;
  }
  std::unique_ptr<std::vector<T>> m_buffer;
};

}  // namespace warpath
