#pragma once
#include <fmt/format.h>

#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

namespace warpath {

/// Bad usage: an option or setting that makes no sense. The command line exits with 2.
struct ConfigError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// A scene, warp or image file that cannot be used; the text starts with file:line:column. The command line exits
/// with 3.
struct FileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// A scene file that cannot be used.
struct SceneError : FileError {
  using FileError::FileError;
};
/// A broken promise inside warpath: our bug, not the user's.
struct InternalError : std::logic_error {
  using std::logic_error::logic_error;
};

namespace detail {
template <class A, class B>
[[noreturn]] void check_failed(const char* file, int line, const char* what, const A& a, const B& b) {
  throw InternalError(fmt::format("{}:{}: check failed: {} ({} against {})", file, line, what, a, b));
}
}  // namespace detail

/// ` did you mean "..."?` for the known name nearest to `name`, or a list of what is known when none is near.
std::string suggestion(std::string_view name, std::span<const std::string_view> known);

}  // namespace warpath

#define WARPATH_CHECK(cond)                                                                                         \
  do {                                                                                                              \
    if (!(cond)) throw ::warpath::InternalError(fmt::format("{}:{}: check failed: {}", __FILE__, __LINE__, #cond)); \
  } while (0)
#define WARPATH_CHECK_EQ(a, b)                                                             \
  do {                                                                                     \
    const auto check_a = (a);                                                              \
    const auto check_b = (b);                                                              \
    if (!(check_a == static_cast<std::remove_cv_t<decltype(check_a)>>(check_b)))           \
      ::warpath::detail::check_failed(__FILE__, __LINE__, #a " == " #b, check_a, check_b); \
  } while (0)
