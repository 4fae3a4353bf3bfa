#pragma once
#include <xmmintrin.h>

#include <pmmintrin.h>

namespace warpath {

/// While it lives, this thread flushes denormal numbers to zero: networks and long paths make many, at 100 cycles each.
class FlushDenormals {
 public:
  FlushDenormals() : m_saved(_mm_getcsr()) {
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
  }
  ~FlushDenormals() { _mm_setcsr(m_saved); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned m_saved;
};

}  // namespace warpath
