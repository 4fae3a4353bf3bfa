#include "scene/mesh_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <charconv>
#include <cstring>

namespace warpath {
namespace {
constexpr std::size_t kPadding = 64;  // from_chars reads eight bytes at a time
}

FileBytes read_bytes(const std::filesystem::path& file) {
  const auto error = [&] { return MeshError(fmt::format("{}: {}", file.string(), std::strerror(errno))); };
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) throw error();
  struct Closer {
    int descriptor;
    ~Closer() { ::close(descriptor); }
  } closer{descriptor};
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) throw error();
  if (!S_ISREG(status.st_mode)) throw MeshError(fmt::format("{}: is no regular file", file.string()));

  FileBytes bytes;
  bytes.size = static_cast<std::size_t>(status.st_size);
  bytes.data = std::make_unique_for_overwrite<char[]>(bytes.size + kPadding);
  for (std::size_t done = 0; done < bytes.size;) {
    const ssize_t count = ::read(descriptor, bytes.data.get() + done, bytes.size - done);
    if (count < 0 && errno != EINTR) throw error();
    if (count == 0) bytes.size = done;  // it shrank meanwhile
    if (count > 0) done += static_cast<std::size_t>(count);
  }
  std::memset(bytes.data.get() + bytes.size, 0, kPadding);
  bytes.data[bytes.size] = '\n';
  return bytes;
}

const char* parse_float(const char* text, float& value) {
  constexpr double kPowers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  while (*text == ' ' || *text == '\t') ++text;
  const char* const start = text;
  const bool negative = *text == '-';
  if (*text == '-' || *text == '+') ++text;

  std::uint64_t digits = 0;
  const char* const first = text;
  for (; static_cast<unsigned char>(*text - '0') < 10; ++text)
    digits = digits * 10 + static_cast<unsigned>(*text - '0');
  std::ptrdiff_t count = text - first, exponent = 0;
  if (*text == '.') {
    const char* const fraction = ++text;
    for (; static_cast<unsigned char>(*text - '0') < 10; ++text)
      digits = digits * 10 + static_cast<unsigned>(*text - '0');
    exponent = fraction - text;
    count -= exponent;
  }
  const bool plain = count > 0 && (*text | 0x20) != 'e';
  if (plain && count <= 18 && exponent >= -22 && digits < (std::uint64_t{1} << 53)) {
    // Both numbers are exact in double precision, so the quotient is rounded once (Clinger 1990). Rounding it again to
    // single precision can only go wrong from halfway between two floats.
    const double magnitude = static_cast<double>(digits) / kPowers[-exponent];
    if ((std::bit_cast<std::uint64_t>(magnitude) & 0x1fffffff) != 0x10000000 && (magnitude > 1e-37 || digits == 0)) {
      value = static_cast<float>(negative ? -magnitude : magnitude);
      return text;
    }
  }
  const char* const number = *start == '+' ? start + 1 : start;
  const auto [stop, error] = std::from_chars(number, number + 512, value);
  if (error == std::errc::invalid_argument) return nullptr;
  if (error == std::errc::result_out_of_range) {
    double wide = 0;  // too small for a float is zero, too large is refused by whoever wants finite numbers
    if (std::from_chars(number, number + 512, wide).ec != std::errc()) wide = 0;
    value = static_cast<float>(wide);
  }
  return stop;
}

}  // namespace warpath
