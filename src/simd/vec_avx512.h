/// @file The vocabulary of vec.h in sixteen lanes, with AVX-512. From here to end_region.h, what is defined
/// is compiled for it: standard headers, Eigen and other headers of the project come before. Where there is
/// no x86-64, the generic words stand in, and nothing is ever called.
#pragma once

#if defined(__x86_64__)

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "simd/intrinsics.h"

#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2,fma,avx512f,avx512dq,avx512bw,avx512vl,bmi2"))), \
                             apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,fma,avx512f,avx512dq,avx512bw,avx512vl,bmi2")
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"  // GCC 12 warns of its own intrinsics (bug 105593)
#pragma GCC diagnostic ignored "-Wuninitialized"
#endif

namespace bki_mapping {
namespace {
constexpr const char* kInstructionSet = "avx512";
constexpr int kLanes = 16;
constexpr bool kHasTable32 = true;
}  // namespace
}  // namespace bki_mapping

#include "simd/vec.h"

namespace bki_mapping {
namespace {

[[gnu::always_inline]] inline FloatVec Min(FloatVec a, FloatVec b) {
  return _mm512_min_ps(a, b);
}
[[gnu::always_inline]] inline FloatVec Max(FloatVec a, FloatVec b) {
  return _mm512_max_ps(a, b);
}
[[gnu::always_inline]] inline FloatVec MinAbs(FloatVec a, FloatVec b) {
  constexpr int kMinWithoutSign = 0b1010;
  return _mm512_range_ps(a, b, kMinWithoutSign);  // one instruction for three
}
[[gnu::always_inline]] inline FloatVec Sqrt(FloatVec v) {
  return _mm512_sqrt_ps(v);
}
[[gnu::always_inline]] inline bool AnyTrue(Mask mask) {
  return _mm512_movepi32_mask(reinterpret_cast<__m512i>(mask)) != 0;
}
[[gnu::always_inline]] inline std::uint64_t BitsFromMask(Mask mask) {
  return _mm512_movepi32_mask(reinterpret_cast<__m512i>(mask));
}
[[gnu::always_inline]] inline FloatVec TableLookupLanes(FloatVec v, IntVec index) {
  return _mm512_permutexvar_ps(reinterpret_cast<__m512i>(index), v);
}
[[gnu::always_inline]] inline FloatVec TableLookup(const Table8<float>& table, IntVec index) {
  return TableLookupLanes(LoadU(table.values), index);
}
[[gnu::always_inline]] inline IntVec TableLookup(const Table8<std::int32_t>& table, IntVec index) {
  return BitCast<IntVec>(TableLookupLanes(BitCast<FloatVec>(LoadU(table.values)), index));
}
struct Table32 {
  FloatVec low, high;

  explicit Table32(const float* values) : low(LoadU(values)), high(LoadU(values + kLanes)) {}
};
[[gnu::always_inline]] inline FloatVec TableLookup(const Table32& table, IntVec index) {
  return _mm512_permutex2var_ps(table.low, reinterpret_cast<__m512i>(index), table.high);
}
template <int kCount>
[[gnu::always_inline]] inline auto ExtractLanes(FloatVec v, [[maybe_unused]] int n) {
  if constexpr (kCount == kLanes) {
    return v;
  } else if constexpr (kCount == 4) {
    switch (n) {
      case 0:
        return _mm512_castps512_ps128(v);
      case 1:
        return _mm512_extractf32x4_ps(v, 1);
      case 2:
        return _mm512_extractf32x4_ps(v, 2);
      default:
        return _mm512_extractf32x4_ps(v, 3);
    }
  } else {
    return n == 0 ? _mm512_castps512_ps256(v) : _mm512_extractf32x8_ps(v, 1);
  }
}
[[gnu::always_inline]] inline void StoreInterleaved2(FloatVec a, FloatVec b, float* to) {
  StoreU(_mm512_unpacklo_ps(a, b), to);
  StoreU(_mm512_unpackhi_ps(a, b), to + kLanes);
}
template <typename Vec, typename Number>
[[gnu::always_inline]] inline void StoreInterleaved4(const Vec (&v)[4], Number* to) {
  const __m512i a = reinterpret_cast<__m512i>(v[0]), b = reinterpret_cast<__m512i>(v[1]),
                c = reinterpret_cast<__m512i>(v[2]), d = reinterpret_cast<__m512i>(v[3]);
  const __m512i low[2] = {_mm512_unpacklo_epi32(a, b), _mm512_unpacklo_epi32(c, d)},
                high[2] = {_mm512_unpackhi_epi32(a, b), _mm512_unpackhi_epi32(c, d)};
  StoreU(_mm512_unpacklo_epi64(low[0], low[1]), to);
  StoreU(_mm512_unpackhi_epi64(low[0], low[1]), to + kLanes);
  StoreU(_mm512_unpacklo_epi64(high[0], high[1]), to + 2 * kLanes);
  StoreU(_mm512_unpackhi_epi64(high[0], high[1]), to + 3 * kLanes);
}

}  // namespace
}  // namespace bki_mapping

#else
#include "simd/vec_generic.h"
#endif
