/// @file The vocabulary of vec.h in four lanes, which every x86-64 (SSE2) and arm64 (NEON) processor has.
#pragma once

namespace bki_mapping {
namespace {
constexpr const char* kInstructionSet = "generic";
constexpr int kLanes = 4;
constexpr bool kHasTable32 = false;
}  // namespace
}  // namespace bki_mapping

#include "simd/vec.h"

namespace bki_mapping {
namespace {

#if defined(__SSE2__)

[[gnu::always_inline]] inline FloatVec Min(FloatVec a, FloatVec b) {
  return _mm_min_ps(a, b);
}
[[gnu::always_inline]] inline FloatVec Max(FloatVec a, FloatVec b) {
  return _mm_max_ps(a, b);
}
[[gnu::always_inline]] inline FloatVec Sqrt(FloatVec v) {
  return _mm_sqrt_ps(v);
}
[[gnu::always_inline]] inline bool AnyTrue(Mask mask) {
  return _mm_movemask_epi8(reinterpret_cast<__m128i>(mask)) != 0;
}
[[gnu::always_inline]] inline std::uint64_t BitsFromMask(Mask mask) {
  return static_cast<std::uint32_t>(_mm_movemask_ps(reinterpret_cast<__m128>(mask)));
}
[[gnu::always_inline]] inline void StoreInterleaved2(FloatVec a, FloatVec b, float* to) {
  StoreU(_mm_unpacklo_ps(a, b), to);
  StoreU(_mm_unpackhi_ps(a, b), to + kLanes);
}

#else

[[gnu::always_inline]] inline FloatVec Min(FloatVec a, FloatVec b) {
  return a < b ? a : b;
}
[[gnu::always_inline]] inline FloatVec Max(FloatVec a, FloatVec b) {
  return a > b ? a : b;
}
[[gnu::always_inline]] inline FloatVec Sqrt(FloatVec v) {
  for (int lane = 0; lane < kLanes; ++lane) v[lane] = std::sqrt(v[lane]);
  return v;
}
[[gnu::always_inline]] inline bool AnyTrue(Mask mask) {
  return (mask[0] | mask[1] | mask[2] | mask[3]) != 0;
}
[[gnu::always_inline]] inline std::uint64_t BitsFromMask(Mask mask) {
  return static_cast<std::uint64_t>((mask[0] & 1) | (mask[1] & 2) | (mask[2] & 4) | (mask[3] & 8));
}
[[gnu::always_inline]] inline void StoreInterleaved2(FloatVec a, FloatVec b, float* to) {
  StoreU(FloatVec{a[0], b[0], a[1], b[1]}, to);
  StoreU(FloatVec{a[2], b[2], a[3], b[3]}, to + kLanes);
}

#endif

[[gnu::always_inline]] inline FloatVec MinAbs(FloatVec a, FloatVec b) {
  return Min(Abs(a), Abs(b));
}
[[gnu::always_inline]] inline FloatVec TableLookupLanes(FloatVec v, IntVec index) {
  return FloatVec{v[index[0]], v[index[1]], v[index[2]], v[index[3]]};
}
[[gnu::always_inline]] inline FloatVec TableLookup(const Table8<float>& table, IntVec index) {
  const auto at = [&](int lane) { return table.values[index[lane]]; };
  return FloatVec{at(0), at(1), at(2), at(3)};
}
[[gnu::always_inline]] inline IntVec TableLookup(const Table8<std::int32_t>& table, IntVec index) {
  const auto at = [&](int lane) { return table.values[index[lane]]; };
  return IntVec{at(0), at(1), at(2), at(3)};
}
template <int kCount>
[[gnu::always_inline]] inline FloatVec ExtractLanes(FloatVec v, int) {
  static_assert(kCount == kLanes);
  return v;
}
template <typename Vec, typename Number>
[[gnu::always_inline]] inline void StoreInterleaved4(const Vec (&v)[4], Number* to) {
  Float4 rows[4] = {BitCast<Float4>(v[0]), BitCast<Float4>(v[1]), BitCast<Float4>(v[2]),
                    BitCast<Float4>(v[3])};
  Transpose4(rows);
  for (int n = 0; n < 4; ++n) StoreU(rows[n], to + n * kLanes);
}

}  // namespace
}  // namespace bki_mapping
