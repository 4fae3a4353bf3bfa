#include "nn/dense_bf16.h"

#include <hwy/highway.h>
#include <immintrin.h>

#include <bit>

namespace warpath::nn::bf16 {

bool available() { return __builtin_cpu_supports("avx512bf16") && !ForceSimdTarget::any(); }

}  // namespace warpath::nn::bf16

// Highway 1.0 has no target with AVX512_BF16, so these kernels are written for it alone.
HWY_PUSH_ATTRIBUTES("avx512f,avx512bw,avx512dq,avx512vl,avx512bf16")
namespace warpath::nn::bf16 {
namespace {

constexpr int kLanes = 16;
constexpr int kTile = 4;  // rows and vectors of a tile: 16 accumulators

HWY_INLINE __m512i Load(const Pair* p) { return _mm512_load_si512(p); }
HWY_INLINE void Store(Pair* p, __m512i v) { _mm512_store_si512(p, v); }
HWY_INLINE __m512bh Halves(__m512i v) { return reinterpret_cast<__m512bh>(v); }
HWY_INLINE __m512 Dot(__m512 sum, Pair weights, __m512i x) {
  return _mm512_dpbf16_ps(sum, Halves(_mm512_set1_epi32(static_cast<int>(weights))), Halves(x));
}
HWY_INLINE __m512 Even(__m512i pairs) { return _mm512_castsi512_ps(_mm512_slli_epi32(pairs, 16)); }
HWY_INLINE __m512 Odd(__m512i pairs) {
  return _mm512_castsi512_ps(_mm512_and_si512(pairs, _mm512_set1_epi32(static_cast<int>(0xffff0000u))));
}
/// Two rows of 16 samples, rounded: one after the other.
HWY_INLINE __m512i Round(__m512 even, __m512 odd) { return reinterpret_cast<__m512i>(_mm512_cvtne2ps_pbh(odd, even)); }
/// ... and in pairs.
HWY_INLINE __m512i Interleave(__m512i rounded) {
  const __m512i order = _mm512_set_epi16(31, 15, 30, 14, 29, 13, 28, 12, 27, 11, 26, 10, 25, 9, 24, 8, 23, 7, 22, 6, 21,
                                         5, 20, 4, 19, 3, 18, 2, 17, 1, 16, 0);
  return _mm512_permutexvar_epi16(order, rounded);
}
HWY_INLINE __m128i RoundEight(float gain, const float* p) {
  return reinterpret_cast<__m128i>(_mm256_cvtneps_pbh(_mm256_mul_ps(_mm256_set1_ps(gain), _mm256_load_ps(p))));
}
HWY_INLINE void StoreGradient(Gradient to, int row, int s, __m512 even, __m512 odd, bool has_odd = true) {
  const __m512i rounded = Round(even, odd);
  _mm256_store_si256(reinterpret_cast<__m256i*>(to.rows + (row * kBlock + s) / 2), _mm512_castsi512_si256(rounded));
  if (has_odd)
    _mm256_store_si256(reinterpret_cast<__m256i*>(to.rows + ((row + 1) * kBlock + s) / 2),
                       _mm512_extracti64x4_epi64(rounded, 1));
  Store(to.pairs + row / 2 * kBlock + s, Interleave(rounded));
}

// What happens to the sums of two rows.
struct Relu {
  static constexpr int kRows = 2;
  Pair* y;
  HWY_INLINE void operator()(int row, int s, __m512 even, __m512 odd) const {
    const __m512i v = Interleave(Round(even, odd));
    Store(y + row / 2 * kBlock + s, _mm512_max_epi16(v, _mm512_setzero_si512()));  // bit patterns are in order
  }
};
struct Gate {
  static constexpr int kRows = 2;
  Gradient to;
  const Pair* act;
  HWY_INLINE void operator()(int row, int s, __m512 even, __m512 odd) const {
    const __m512i a = Load(act + row / 2 * kBlock + s);
    StoreGradient(
        to, row, s, _mm512_maskz_mov_ps(_mm512_test_epi32_mask(a, _mm512_set1_epi32(0xffff)), even),
        _mm512_maskz_mov_ps(_mm512_test_epi32_mask(a, _mm512_set1_epi32(static_cast<int>(0xffff0000u))), odd));
  }
};
/// F, of the sums and what `skip` holds.
template <class F>
struct WithSkip {
  static constexpr int kRows = 2;
  F f;
  const Pair* skip;
  HWY_INLINE void operator()(int row, int s, __m512 even, __m512 odd) const {
    const __m512i more = Load(skip + row / 2 * kBlock + s);
    f(row, s, _mm512_add_ps(even, Even(more)), _mm512_add_ps(odd, Odd(more)));
  }
};
// ... and to those of one row.
struct Linear {
  static constexpr int kRows = 1;
  float* y;
  HWY_INLINE void operator()(int row, int s, __m512 sum) const { _mm512_store_ps(y + row * kBlock + s, sum); }
};
struct Add {
  static constexpr int kRows = 1;
  float* y;
  HWY_INLINE void operator()(int row, int s, __m512 sum) const {
    float* const at = y + row * kBlock + s;
    _mm512_store_ps(at, _mm512_add_ps(sum, _mm512_load_ps(at)));
  }
};

template <int R, int C>
struct Sums {
  __m512 acc[R][C];

  /// Rows of packed weights w against samples from x on.
  HWY_INLINE void Compute(int inputs, const Pair* HWY_RESTRICT w, const Pair* HWY_RESTRICT x) {
    HWY_UNROLL(8)
    for (int r = 0; r < R; ++r) {
      const __m512 bias = _mm512_castsi512_ps(_mm512_set1_epi32(static_cast<int>(w[r])));
      HWY_UNROLL(4)
      for (int c = 0; c < C; ++c) acc[r][c] = bias;
    }
    w += kGroup;
    for (int p = 0; p < pairs(inputs); ++p, w += kGroup, x += kBlock) {
      __m512i xv[C];
      HWY_UNROLL(4)
      for (int c = 0; c < C; ++c) xv[c] = Load(x + c * kLanes);
      HWY_UNROLL(8)
      for (int r = 0; r < R; ++r) {
        HWY_UNROLL(4)
        for (int c = 0; c < C; ++c) acc[r][c] = Dot(acc[r][c], w[r], xv[c]);
      }
    }
  }
};

template <int R, int C, class F>
HWY_INLINE void Tile(int inputs, const Pair* w, const Pair* x, int row, F f) {
  for (int s = 0; s < kBlock; s += C * kLanes) {
    Sums<R, C> sums;
    sums.Compute(inputs, w, x + s);
    HWY_UNROLL(8)
    for (int r = 0; r < R; r += F::kRows) {
      HWY_UNROLL(4)
      for (int c = 0; c < C; ++c) {
        if constexpr (F::kRows == 2) {
          f(row + r, s + c * kLanes, sums.acc[r][c], sums.acc[r + 1][c]);
        } else {
          f(row + r, s + c * kLanes, sums.acc[r][c]);
        }
      }
    }
  }
}

template <class F>
HWY_INLINE void Layer(int inputs, int outputs, const Pair* w, const Pair* x, F f) {
  for (int o = 0; o < outputs; o += kGroup, w += kGroup * (pairs(inputs) + 1)) {
    int row = 0;
    const int rows = HWY_MIN(outputs - o, kGroup);
    for (; row + kTile <= rows; row += kTile) Tile<kTile, kTile>(inputs, w + row, x, o + row, f);
    for (; row + 2 <= rows; row += 2) Tile<2, 4>(inputs, w + row, x, o + row, f);
    if constexpr (F::kRows == 1)
      for (; row < rows; ++row) Tile<1, 4>(inputs, w + row, x, o + row, f);
  }
}

// 8 pairs of rows x 16 samples -> 8 pairs of samples x 16 rows. In each 64-bit lane the words of two samples change
// places, so that its halves belong to a row each; then the lanes are transposed.
HWY_INLINE void TransposeSquare(const Pair* HWY_RESTRICT x, int count, Pair* HWY_RESTRICT out) {
  const __m512i swap = _mm512_broadcast_i32x4(_mm_set_epi8(15, 14, 11, 10, 13, 12, 9, 8, 7, 6, 3, 2, 5, 4, 1, 0));
  __m512i v[8], t[8];
  HWY_UNROLL(8)
  for (int i = 0; i < 8; ++i)
    v[i] = i < count ? _mm512_shuffle_epi8(Load(x + i * kBlock), swap) : _mm512_setzero_si512();
  HWY_UNROLL(4)
  for (int i = 0; i < 8; i += 2) {
    t[i] = _mm512_unpacklo_epi64(v[i], v[i + 1]);      // lanes 0, 2, 4, 6 of rows i and i + 1
    t[i + 1] = _mm512_unpackhi_epi64(v[i], v[i + 1]);  // lanes 1, 3, 5, 7
  }
  HWY_UNROLL(2)
  for (int odd = 0; odd < 2; ++odd) {
    const __m512i a = _mm512_shuffle_i64x2(t[odd], t[2 + odd], 0x88),
                  b = _mm512_shuffle_i64x2(t[odd], t[2 + odd], 0xdd);
    const __m512i c = _mm512_shuffle_i64x2(t[4 + odd], t[6 + odd], 0x88);
    const __m512i e = _mm512_shuffle_i64x2(t[4 + odd], t[6 + odd], 0xdd);
    Store(out + (0 + odd) * kLanes, _mm512_shuffle_i64x2(a, c, 0x88));
    Store(out + (2 + odd) * kLanes, _mm512_shuffle_i64x2(b, e, 0x88));
    Store(out + (4 + odd) * kLanes, _mm512_shuffle_i64x2(a, c, 0xdd));
    Store(out + (6 + odd) * kLanes, _mm512_shuffle_i64x2(b, e, 0xdd));
  }
}

constexpr int kSamplePairs = kBlock / 2;

// R rows of g against P panels of 16 inputs each.
template <int R, int P>
HWY_INLINE void GradientTile(const Pair* HWY_RESTRICT g, const Pair* HWY_RESTRICT xt, float* HWY_RESTRICT dw,
                             int stride, bool accumulate) {
  __m512 acc[R][P];
  HWY_UNROLL(8)
  for (int r = 0; r < R; ++r) {
    HWY_UNROLL(2)
    for (int p = 0; p < P; ++p)
      acc[r][p] = accumulate ? _mm512_load_ps(dw + r * stride + p * kLanes) : _mm512_setzero_ps();
  }
  for (int s = 0; s < kSamplePairs; ++s, ++g, xt += kLanes) {
    __m512i xv[P];
    HWY_UNROLL(2)
    for (int p = 0; p < P; ++p) xv[p] = Load(xt + p * kSamplePairs * kLanes);
    HWY_UNROLL(8)
    for (int r = 0; r < R; ++r) {
      HWY_UNROLL(2)
      for (int p = 0; p < P; ++p) acc[r][p] = Dot(acc[r][p], g[r * kSamplePairs], xv[p]);
    }
  }
  HWY_UNROLL(8)
  for (int r = 0; r < R; ++r) {
    HWY_UNROLL(2)
    for (int p = 0; p < P; ++p) _mm512_store_ps(dw + r * stride + p * kLanes, acc[r][p]);
  }
}

template <int R>
HWY_INLINE void GradientRows(int panels, const Pair* g, const Pair* xt, float* dw, bool accumulate) {
  constexpr int kPanel = kSamplePairs * kLanes;
  int p = 0;
  for (; p + 2 <= panels; p += 2) GradientTile<R, 2>(g, xt + p * kPanel, dw + p * kLanes, panels * kLanes, accumulate);
  for (; p < panels; ++p) GradientTile<R, 1>(g, xt + p * kPanel, dw + p * kLanes, panels * kLanes, accumulate);
}

/// Sums of the lanes of 16 vectors.
HWY_INLINE __m512 SumEach(__m512 (&v)[16]) {
  HWY_UNROLL(8)
  for (int i = 0; i < 8; ++i) {  // rows 2i and 2i + 1 in turn
    const __m512 a = v[2 * i], b = v[2 * i + 1];
    v[i] = _mm512_add_ps(_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
  }
  HWY_UNROLL(4)
  for (int i = 0; i < 4; ++i) {  // rows 4i to 4i + 3 in each 128 bits
    const __m512d a = _mm512_castps_pd(v[2 * i]), b = _mm512_castps_pd(v[2 * i + 1]);
    v[i] = _mm512_add_ps(_mm512_castpd_ps(_mm512_unpacklo_pd(a, b)), _mm512_castpd_ps(_mm512_unpackhi_pd(a, b)));
  }
  HWY_UNROLL(2)
  for (int i = 0; i < 2; ++i)
    v[i] = _mm512_add_ps(_mm512_shuffle_f32x4(v[2 * i], v[2 * i + 1], 0x88),
                         _mm512_shuffle_f32x4(v[2 * i], v[2 * i + 1], 0xdd));
  return _mm512_add_ps(_mm512_shuffle_f32x4(v[0], v[1], 0x88), _mm512_shuffle_f32x4(v[0], v[1], 0xdd));
}

HWY_INLINE void BiasGradient(int outputs, const Pair* g, float* db, bool accumulate) {
  const __m512bh ones = Halves(_mm512_set1_epi32(0x3f803f80));
  for (int o = 0; o < outputs; o += 16) {
    const int rows = HWY_MIN(outputs - o, 16);
    __m512 sums[16];
    for (int r = 0; r < 16; ++r) {
      sums[r] = _mm512_setzero_ps();
      for (int s = 0; r < rows && s < kSamplePairs; s += kLanes)
        sums[r] = _mm512_dpbf16_ps(sums[r], Halves(Load(g + (o + r) * kSamplePairs + s)), ones);
    }
    __m512 total = SumEach(sums);
    const auto mask = static_cast<__mmask16>((1u << rows) - 1);
    if (accumulate) total = _mm512_add_ps(total, _mm512_maskz_loadu_ps(mask, db + o));
    _mm512_mask_storeu_ps(db + o, mask, total);
  }
}

}  // namespace

void pack(int inputs, int outputs, const float* weight, const float* gain, const float* bias, Pair* packed) {
  const int stride = padded_inputs(inputs), words = pairs(inputs);
  for (int o = 0; o < outputs; o += kGroup, packed += kGroup * (words + 1)) {
    for (int r = 0; r < kGroup; ++r) packed[r] = o + r < outputs ? std::bit_cast<Pair>(bias[o + r]) : 0;
    for (int k = 0; k < stride; k += 16) {
      // 8 rows of 8 words, transposed.
      __m256i v[8], t[8];
      for (int r = 0; r < 8; ++r)
        v[r] = o + r < outputs ? reinterpret_cast<__m256i>(_mm512_cvtneps_pbh(_mm512_mul_ps(
                                     _mm512_set1_ps(gain[o + r]), _mm512_load_ps(weight + (o + r) * stride + k))))
                               : _mm256_setzero_si256();
      for (int r = 0; r < 8; r += 2) {
        t[r] = _mm256_unpacklo_epi32(v[r], v[r + 1]);
        t[r + 1] = _mm256_unpackhi_epi32(v[r], v[r + 1]);
      }
      for (int r = 0; r < 8; r += 4) {
        v[r] = _mm256_unpacklo_epi64(t[r], t[r + 2]);
        v[r + 1] = _mm256_unpackhi_epi64(t[r], t[r + 2]);
        v[r + 2] = _mm256_unpacklo_epi64(t[r + 1], t[r + 3]);
        v[r + 3] = _mm256_unpackhi_epi64(t[r + 1], t[r + 3]);
      }
      for (int p = 0; p < 8 && k / 2 + p < words; ++p) {
        const __m256i a = v[p % 4], b = v[4 + p % 4];
        _mm256_store_si256(reinterpret_cast<__m256i*>(packed + (k / 2 + p + 1) * kGroup),
                           p < 4 ? _mm256_permute2x128_si256(a, b, 0x20) : _mm256_permute2x128_si256(a, b, 0x31));
      }
    }
  }
}

void pack_transposed(int inputs, int outputs, const float* weight, const float* gain, Pair* packed) {
  const int stride = padded_inputs(inputs), words = pairs(outputs);
  for (int k = 0; k < inputs; k += kGroup, packed += kGroup * (words + 1)) {
    for (int r = 0; r < kGroup; ++r) packed[r] = 0;
    for (int p = 0; p < words; ++p) {
      const int o = 2 * p;
      const float* const row = weight + o * stride + k;
      const __m128i even = RoundEight(gain[o], row);
      const __m128i odd = o + 1 < outputs ? RoundEight(gain[o + 1], row + stride) : _mm_setzero_si128();
      __m128i* const to = reinterpret_cast<__m128i*>(packed + (p + 1) * kGroup);
      _mm_store_si128(to, _mm_unpacklo_epi16(even, odd));
      _mm_store_si128(to + 1, _mm_unpackhi_epi16(even, odd));
    }
  }
}

void narrow(int rows, const float* x, Pair* to) {
  for (int row = 0; row < rows; row += 2)
    for (int s = 0; s < kBlock; s += kLanes) {
      const float* const from = x + row * kBlock + s;
      const __m512 even = _mm512_load_ps(from);
      const __m512 odd = row + 1 < rows ? _mm512_load_ps(from + kBlock) : _mm512_setzero_ps();
      Store(to + row / 2 * kBlock + s, Interleave(Round(even, odd)));
    }
}

void dense(int inputs, int outputs, const Pair* packed, const Pair* x, Pair* y, const Pair* skip) {
  const Relu relu{y};
  if (skip) return Layer(inputs, outputs, packed, x, WithSkip<Relu>{relu, skip});
  Layer(inputs, outputs, packed, x, relu);
}

void dense_out(int inputs, int outputs, const Pair* packed, const Pair* x, float* y, bool accumulate) {
  if (accumulate) return Layer(inputs, outputs, packed, x, Add{y});
  Layer(inputs, outputs, packed, x, Linear{y});
}

void narrow_gradient(int rows, const float* g, Gradient to) {
  for (int row = 0; row < rows; row += 2)
    for (int s = 0; s < kBlock; s += kLanes) {
      const bool has_odd = row + 1 < rows;
      const float* const from = g + row * kBlock + s;
      StoreGradient(to, row, s, _mm512_load_ps(from), has_odd ? _mm512_load_ps(from + kBlock) : _mm512_setzero_ps(),
                    has_odd);
    }
}

void dense_back(int inputs, int outputs, const Pair* packed, const Pair* g, const Pair* skip, const Pair* act,
                Gradient to) {
  const Gate gate{to, act};
  if (skip) return Layer(inputs, outputs, packed, g, WithSkip<Gate>{gate, skip});
  Layer(inputs, outputs, packed, g, gate);
}

void transpose(int rows, const Pair* x, Pair* xt) {
  for (int panel = 0; panel < padded_inputs(rows) / 16; ++panel)
    for (int s = 0; s < kBlock; s += 16)
      TransposeSquare(x + panel * 8 * kBlock + s, pairs(rows) - panel * 8,
                      xt + (panel * kSamplePairs + s / 2) * kLanes);
}

void dense_gradient(int inputs, int outputs, const Pair* g, const Pair* xt, float* dw, float* db, bool accumulate) {
  const int stride = padded_inputs(inputs), panels = stride / 16;
  int o = 0;
  for (; o + 8 <= outputs; o += 8) GradientRows<8>(panels, g + o * kSamplePairs, xt, dw + o * stride, accumulate);
  for (; o + 2 <= outputs; o += 2) GradientRows<2>(panels, g + o * kSamplePairs, xt, dw + o * stride, accumulate);
  for (; o < outputs; ++o) GradientRows<1>(panels, g + o * kSamplePairs, xt, dw + o * stride, accumulate);
  BiasGradient(outputs, g, db, accumulate);
}

}  // namespace warpath::nn::bf16
HWY_POP_ATTRIBUTES
