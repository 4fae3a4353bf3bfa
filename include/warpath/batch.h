#pragma once
#include <cstddef>
#include <span>
#include <type_traits>
#include <vector>

namespace warpath {

/// A view of `rows` x `cols` numbers, row-major; rows are `stride` elements apart. It owns nothing.
template <class T>
class Batch {
 public:
  Batch() = default;
  Batch(T* data, std::size_t rows, std::size_t cols, std::size_t stride)
      : m_data(data), m_rows(rows), m_cols(cols), m_stride(stride) {}
  Batch(T* data, std::size_t rows, std::size_t cols) : Batch(data, rows, cols, cols) {}
  /// A view of numbers to write is also a view of numbers to read.
  operator Batch<const T>() const requires(!std::is_const_v<T>) { return {m_data, m_rows, m_cols, m_stride}; }

  std::size_t rows() const { return m_rows; }
  std::size_t cols() const { return m_cols; }
  std::size_t stride() const { return m_stride; }
  T* data() const { return m_data; }
  T& operator()(std::size_t row, std::size_t col) const { return m_data[row * m_stride + col]; }
  std::span<T> row(std::size_t row) const { return {m_data + row * m_stride, m_cols}; }
  Batch rows_from(std::size_t first, std::size_t count) const {
    return {m_data + first * m_stride, count, m_cols, m_stride};
  }

 private:
  T* m_data = nullptr;
  std::size_t m_rows = 0, m_cols = 0, m_stride = 0;
};

/// A dense matrix that owns its numbers; hand it on as a Batch.
template <class T>
class Matrix {
 public:
  Matrix() = default;
  Matrix(std::size_t rows, std::size_t cols) : m_rows(rows), m_cols(cols), m_data(rows * cols) {}
  std::size_t rows() const { return m_rows; }
  std::size_t cols() const { return m_cols; }
  T& operator()(std::size_t row, std::size_t col) { return m_data[row * m_cols + col]; }
  const T& operator()(std::size_t row, std::size_t col) const { return m_data[row * m_cols + col]; }
  Batch<T> batch() { return {m_data.data(), m_rows, m_cols}; }
  Batch<const T> batch() const { return {m_data.data(), m_rows, m_cols}; }
  std::vector<T>& values() { return m_data; }
  const std::vector<T>& values() const { return m_data; }

 private:
  std::size_t m_rows = 0, m_cols = 0;
  std::vector<T> m_data;
};

}  // namespace warpath
