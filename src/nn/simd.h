#pragma once
#include <cstddef>
#include <cstdint>
#include <new>
#include <string>
#include <vector>

namespace warpath::nn {

/// Samples that go through a network together. Activations are feature-major, x[feature * kBlock + sample]: samples
/// stand in the lanes, weights are broadcast.
inline constexpr int kBlock = 64;

/// Cache lines and the widest vectors are 64 bytes.
inline constexpr std::size_t kAlignment = 64;

template <class T>
struct AlignedAllocator {
  using value_type = T;
  AlignedAllocator() = default;
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) {}
  T* allocate(std::size_t n) { return static_cast<T*>(::operator new(n * sizeof(T), std::align_val_t(kAlignment))); }
  void deallocate(T* p, std::size_t) { ::operator delete(p, std::align_val_t(kAlignment)); }
  bool operator==(const AlignedAllocator&) const = default;
};
template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

inline constexpr int round_up(int n, int multiple) { return (n + multiple - 1) / multiple * multiple; }

/// Instruction sets that the kernels were built for and this CPU has, best first: `AVX3` (AVX-512), `AVX2`.
std::vector<std::string> simd_targets();

/// While it lives, every kernel runs on the named target. For tests and benchmarks; not for use while others compute.
class ForceSimdTarget {
 public:
  explicit ForceSimdTarget(const std::string& name);
  ~ForceSimdTarget();
  ForceSimdTarget(const ForceSimdTarget&) = delete;
  ForceSimdTarget& operator=(const ForceSimdTarget&) = delete;

  static bool any();  ///< whether one lives
};

}  // namespace warpath::nn
