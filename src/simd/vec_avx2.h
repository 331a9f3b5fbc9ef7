/// @file The vocabulary of vec.h in eight lanes, with AVX2 and FMA. From here to end_region.h, what is
/// defined is compiled for these: standard headers, Eigen and other headers of the project come before. Where
/// there is no x86-64, the generic words stand in, and nothing is ever called.
#pragma once

#if defined(__x86_64__)

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "simd/intrinsics.h"

#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,fma")
#endif

namespace bki_mapping {
namespace {
constexpr const char* kInstructionSet = "avx2";
constexpr int kLanes = 8;
constexpr bool kHasTable32 = false;
}  // namespace
}  // namespace bki_mapping

#include "simd/vec.h"

namespace bki_mapping {
namespace {

[[gnu::always_inline]] inline FloatVec Min(FloatVec a, FloatVec b) {
  return _mm256_min_ps(a, b);
}
[[gnu::always_inline]] inline FloatVec Max(FloatVec a, FloatVec b) {
  return _mm256_max_ps(a, b);
}
[[gnu::always_inline]] inline FloatVec MinAbs(FloatVec a, FloatVec b) {
  return Min(Abs(a), Abs(b));
}
[[gnu::always_inline]] inline FloatVec Sqrt(FloatVec v) {
  return _mm256_sqrt_ps(v);
}
[[gnu::always_inline]] inline bool AnyTrue(Mask mask) {
  return _mm256_movemask_ps(reinterpret_cast<__m256>(mask)) != 0;
}
[[gnu::always_inline]] inline std::uint64_t BitsFromMask(Mask mask) {
  return static_cast<std::uint32_t>(_mm256_movemask_ps(reinterpret_cast<__m256>(mask)));
}
[[gnu::always_inline]] inline FloatVec TableLookupLanes(FloatVec v, IntVec index) {
  return _mm256_permutevar8x32_ps(v, reinterpret_cast<__m256i>(index));
}
[[gnu::always_inline]] inline FloatVec TableLookup(const Table8<float>& table, IntVec index) {
  return TableLookupLanes(LoadU(table.values), index);
}
[[gnu::always_inline]] inline IntVec TableLookup(const Table8<std::int32_t>& table, IntVec index) {
  return BitCast<IntVec>(TableLookupLanes(BitCast<FloatVec>(LoadU(table.values)), index));
}
template <int kCount>
[[gnu::always_inline]] inline auto ExtractLanes(FloatVec v, [[maybe_unused]] int n) {
  static_assert(kCount == 4 || kCount == kLanes);
  if constexpr (kCount == kLanes) {
    return v;
  } else {
    return n == 0 ? Float4(_mm256_castps256_ps128(v)) : Float4(_mm256_extractf128_ps(v, 1));
  }
}
[[gnu::always_inline]] inline void StoreInterleaved2(FloatVec a, FloatVec b, float* to) {
  StoreU(_mm256_unpacklo_ps(a, b), to);
  StoreU(_mm256_unpackhi_ps(a, b), to + kLanes);
}
template <typename Vec, typename Number>
[[gnu::always_inline]] inline void StoreInterleaved4(const Vec (&v)[4], Number* to) {
  const __m256i a = reinterpret_cast<__m256i>(v[0]), b = reinterpret_cast<__m256i>(v[1]),
                c = reinterpret_cast<__m256i>(v[2]), d = reinterpret_cast<__m256i>(v[3]);
  const __m256i low[2] = {_mm256_unpacklo_epi32(a, b), _mm256_unpacklo_epi32(c, d)},
                high[2] = {_mm256_unpackhi_epi32(a, b), _mm256_unpackhi_epi32(c, d)};
  StoreU(_mm256_unpacklo_epi64(low[0], low[1]), to);
  StoreU(_mm256_unpackhi_epi64(low[0], low[1]), to + kLanes);
  StoreU(_mm256_unpacklo_epi64(high[0], high[1]), to + 2 * kLanes);
  StoreU(_mm256_unpackhi_epi64(high[0], high[1]), to + 3 * kLanes);
}

}  // namespace
}  // namespace bki_mapping

#else
#include "simd/vec_generic.h"
#endif
