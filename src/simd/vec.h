/// @file The vector vocabulary, in which the loops over points and lines are written: to be read before them.
/// They see it by way of vec_generic.h, vec_avx2.h or vec_avx512.h, which set kLanes, include this file, and
/// define the remaining words. Names are Highway's where Highway has the word.
///
/// - FloatVec, IntVec, ByteVec: kLanes floats, 32-bit integers, unsigned bytes. Arithmetic, shifts,
/// comparisons and & | ~ are
///   operators, also with a single number on one side.
/// - Float4: four floats, on every instruction set.
/// - Mask: an IntVec whose lanes are 0 or -1, which is what a comparison gives.
/// - Set(x): x in all lanes. Zero is FloatVec{} or IntVec{}.
/// - Iota(): 0, 1, 2, ...
/// - LoadU(p), StoreU(v, p): from and to memory of any alignment. LoadFour(p): a Float4.
/// - AddU(v, p): adds to the numbers at p.
/// - AddPairs(v, p, q): adds lanes 0 and 1 of a Float4 at p, lanes 2 and 3 at q; the two must not overlap.
/// - ConvertTo<V>(v): integers to floats, floats to integers towards 0, or integers to their lowest bytes.
/// - BitCast<V>(v): the same bits as another type.
/// - Min(a, b), Max(a, b): lane by lane. Floats must not be NaN.
/// - Abs(v), Sqrt(v): lane by lane. MinAbs(a, b): Min(Abs(a), Abs(b)).
/// - IfThenElse(m, a, b): a where the mask is set, else b.
/// - AnyTrue(m): whether any lane of the mask is set. BitsFromMask(m): bit n is lane n. MaskFromBits(b): the
///   inverse; higher bits are ignored.
/// - TableLookupLanes(v, i): lane n is v[i[n]].
/// - TableLookup(t, i): lane n is element i[n] of a table: Table8, eight numbers in memory, or Table32, 32
///   floats in two registers, of i[n] modulo 32. The latter only where kHasTable32.
/// - ExtractLanes<k>(v, n): the n-th k lanes; k is 4, 8 or kLanes.
/// - StoreInterleaved2(a, b, p): stores pairs of one element of a and one of b; the pair of an even lane is
/// at
///   p + Interleaved2(lane), followed by that of the next lane. StoreInterleaved4(v, p): stores fours, one of
///   each of v[0] to v[3], at p + Interleaved4(lane). Unlike Highway's, they do not keep the order of lanes:
///   that would cost a permutation across the register for each vector.
/// - Transpose4(rows): rows to columns, in four Float4.
///
/// MulAdd is not needed: a * b + c is fused where the instruction set allows, and is then rounded only once.
///
/// Everything is in unnamed namespaces, as are the algorithms: if two objects define a function of the same
/// name, the linker keeps one, and that one may use instructions that the processor lacks.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "simd/intrinsics.h"

namespace bki_mapping {
namespace {

typedef float FloatVec __attribute__((vector_size(kLanes * sizeof(float))));
typedef std::int32_t IntVec __attribute__((vector_size(kLanes * sizeof(std::int32_t))));
typedef IntVec Mask;
typedef std::uint8_t ByteVec __attribute__((vector_size(kLanes)));
typedef float Float4 __attribute__((vector_size(4 * sizeof(float))));

[[gnu::always_inline]] inline FloatVec Set(float x) {
  return x - FloatVec{};  // exact, for -0, too
}
[[gnu::always_inline]] inline IntVec Set(std::int32_t x) {
  return x - IntVec{};
}
[[gnu::always_inline]] inline IntVec Iota() {
  IntVec v = {};
  for (int lane = 0; lane < kLanes; ++lane) v[lane] = lane;
  return v;
}
[[gnu::always_inline]] inline FloatVec LoadU(const float* from) {
  FloatVec v;
  __builtin_memcpy(&v, from, sizeof(v));
  return v;
}
[[gnu::always_inline]] inline IntVec LoadU(const std::int32_t* from) {
  IntVec v;
  __builtin_memcpy(&v, from, sizeof(v));
  return v;
}
[[gnu::always_inline]] inline Float4 LoadFour(const float* from) {
  Float4 v;
  __builtin_memcpy(&v, from, sizeof(v));
  return v;
}
template <typename Vec, typename Number>
[[gnu::always_inline]] inline void StoreU(Vec v, Number* to) {
  __builtin_memcpy(to, &v, sizeof(v));
}
template <typename Vec>
[[gnu::always_inline]] inline void AddU(Vec v, float* to) {
  Vec sums;
  __builtin_memcpy(&sums, to, sizeof(sums));
  sums += v;
  __builtin_memcpy(to, &sums, sizeof(sums));
}
template <typename To, typename From>
[[gnu::always_inline]] inline To ConvertTo(From v) {
  return __builtin_convertvector(v, To);
}
template <typename To, typename From>
[[gnu::always_inline]] inline To BitCast(From v) {
  return reinterpret_cast<To>(v);
}
template <typename Vec>
[[gnu::always_inline]] inline Vec IfThenElse(Mask mask, Vec a, Vec b) {
  return mask ? a : b;
}
[[gnu::always_inline]] inline Mask MaskFromBits(std::uint64_t bits) {
  return (Set(static_cast<std::int32_t>(bits)) & (1 << Iota())) != 0;
}
[[gnu::always_inline]] inline IntVec Min(IntVec a, IntVec b) {
  return a < b ? a : b;
}
[[gnu::always_inline]] inline IntVec Max(IntVec a, IntVec b) {
  return a > b ? a : b;
}
[[gnu::always_inline]] inline FloatVec Abs(FloatVec v) {
  return BitCast<FloatVec>(BitCast<IntVec>(v) & 0x7fffffff);
}

/// Padded to a register, so that one load takes it all.
template <typename Number>
struct Table8 {
  static constexpr int kSize = kLanes > 8 ? kLanes : 8;

  alignas(64) Number values[kSize];
};
struct Table32;  // defined where kHasTable32

// What unpacking the halves of 128 bits gives: the low ones in the first register, the high ones in the
// second.
constexpr int Interleaved2(int lane) {
  return lane / 4 * 4 + lane % 2 * 2 + lane % 4 / 2 * kLanes;
}
constexpr int Interleaved4(int lane) {
  return lane % 4 * kLanes + lane / 4 * 4;
}

#if defined(__SSE2__)

[[gnu::always_inline]] inline void Transpose4(Float4 (&rows)[4]) {
  const __m128 low[2] = {_mm_unpacklo_ps(rows[0], rows[1]), _mm_unpacklo_ps(rows[2], rows[3])},
               high[2] = {_mm_unpackhi_ps(rows[0], rows[1]), _mm_unpackhi_ps(rows[2], rows[3])};
  rows[0] = _mm_movelh_ps(low[0], low[1]);
  rows[1] = _mm_movehl_ps(low[1], low[0]);
  rows[2] = _mm_movelh_ps(high[0], high[1]);
  rows[3] = _mm_movehl_ps(high[1], high[0]);
}
[[gnu::always_inline]] inline void AddPairs(Float4 v, float* a, float* b) {
  __m64 *const first = reinterpret_cast<__m64*>(a), *const second = reinterpret_cast<__m64*>(b);
  const __m128 sums = _mm_loadh_pi(_mm_loadl_pi(_mm_setzero_ps(), first), second) + static_cast<__m128>(v);
  _mm_storel_pi(first, sums);
  _mm_storeh_pi(second, sums);
}

#else

[[gnu::always_inline]] inline void Transpose4(Float4 (&rows)[4]) {
  const Float4 old[4] = {rows[0], rows[1], rows[2], rows[3]};
  for (int n = 0; n < 4; ++n) rows[n] = Float4{old[0][n], old[1][n], old[2][n], old[3][n]};
}
[[gnu::always_inline]] inline void AddPairs(Float4 v, float* a, float* b) {
  for (int n = 0; n < 2; ++n) {
    a[n] += v[n];
    b[n] += v[2 + n];
  }
}

#endif

}  // namespace
}  // namespace bki_mapping
