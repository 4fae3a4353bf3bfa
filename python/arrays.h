#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <csignal>
#include <span>

#include "core/interrupt.h"
#include "warpath/batch.h"
#include "warpath/error.h"

// What the bindings share: NumPy arrays as batches, without copies, and Ctrl-C.
namespace warpath::python {

namespace nb = nanobind;

template <class T>
using Rows = nb::ndarray<T, nb::numpy, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
template <class T>
using Numbers = nb::ndarray<T, nb::numpy, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

template <class T>
Batch<T> batch(const Rows<T>& array) {
  return {array.data(), array.shape(0), array.shape(1)};
}
template <class T>
std::span<T> span(const Numbers<T>& array) {
  return {array.data(), array.shape(0)};
}

inline void check(bool condition, const char* what) {
  if (!condition) throw ConfigError(what);
}

/// Ctrl-C ends what is under way; Python then raises KeyboardInterrupt.
class StopOnInterrupt {
 public:
  StopOnInterrupt() : m_before(std::signal(SIGINT, [](int) { g_interrupted = true; })) {}
  ~StopOnInterrupt() {
    std::signal(SIGINT, m_before);
    if (g_interrupted.exchange(false)) std::raise(SIGINT);
  }

 private:
  void (*m_before)(int);
};

/// Errors of warpath as Python's: ValueError, OSError, KeyboardInterrupt.
inline void register_errors() {
  nb::register_exception_translator([](const std::exception_ptr& p, void*) {
    try {
      std::rethrow_exception(p);
    } catch (const ConfigError& error) {
      PyErr_SetString(PyExc_ValueError, error.what());
    } catch (const FileError& error) {
      PyErr_SetString(PyExc_OSError, error.what());
    } catch (const Interrupted&) {
      PyErr_SetNone(PyExc_KeyboardInterrupt);
    }
  });
}

}  // namespace warpath::python
