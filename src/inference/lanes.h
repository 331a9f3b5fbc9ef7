/// @file Several numbers side by side, in GCC's vector extension (which Clang has too): arithmetic is written
/// as for one number. Included by the inner loops alone, whose files set kLanes by their instruction set.
#pragma once

#include <cmath>
#include <cstdint>
#if defined(__AVX2__)
#include <immintrin.h>
#endif

namespace bki_mapping {
namespace {

#if defined(__AVX512F__)
constexpr int kLanes = 16;
#elif defined(__AVX2__)
constexpr int kLanes = 8;
#else
constexpr int kLanes = 4;  // every x86-64 and arm64 processor has these
#endif

typedef float FloatLanes __attribute__((vector_size(kLanes * sizeof(float))));
typedef std::int32_t IntLanes __attribute__((vector_size(kLanes * sizeof(std::int32_t))));

[[gnu::always_inline]] inline FloatLanes load(const float* from) {
  FloatLanes lanes;
  __builtin_memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}
[[gnu::always_inline]] inline IntLanes load(const std::int32_t* from) {
  IntLanes lanes;
  __builtin_memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}
[[gnu::always_inline]] inline void store(float* to, FloatLanes lanes) {
  __builtin_memcpy(to, &lanes, sizeof(lanes));
}
[[gnu::always_inline]] inline FloatLanes toFloat(IntLanes lanes) {
  return __builtin_convertvector(lanes, FloatLanes);
}
/// kCount numbers, repeated in all lanes. @param from aligned to kCount numbers.
template <int kCount>
[[gnu::always_inline]] inline FloatLanes repeat(const float* from) {
#if defined(__AVX512F__)
  static_assert(kCount == 4);
  return _mm512_broadcast_f32x4(_mm_load_ps(from));
#elif defined(__AVX2__)
  static_assert(kCount == 2);
  double both;
  __builtin_memcpy(&both, from, sizeof(both));
  return _mm256_castpd_ps(_mm256_set1_pd(both));
#else
  static_assert(kCount == 1);
  return FloatLanes{} + *from;
#endif
}
/// kLanes / kCount small whole numbers, each in kCount lanes side by side.
template <int kCount>
[[gnu::always_inline]] inline IntLanes repeatBytes(const unsigned char* from) {
#if defined(__AVX2__)
  static_assert(kLanes / kCount == 4);
  std::int32_t four;
  __builtin_memcpy(&four, from, sizeof(four));
  const __m128i numbers = _mm_cvtepu8_epi32(_mm_cvtsi32_si128(four));
#if defined(__AVX512F__)
  return reinterpret_cast<IntLanes>(_mm512_permutexvar_epi32(
      _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3), _mm512_castsi128_si512(numbers)));
#else
  return reinterpret_cast<IntLanes>(_mm256_permutevar8x32_epi32(_mm256_castsi128_si256(numbers),
                                                                _mm256_setr_epi32(0, 0, 1, 1, 2, 2, 3, 3)));
#endif
#else
  IntLanes lanes;
  for (int lane = 0; lane < kLanes; ++lane) lanes[lane] = from[lane / kCount];
  return lanes;
#endif
}
/// Eight numbers, to be looked up several at a time.
template <typename Number>
struct Table {
  static constexpr int kSize = kLanes > 8 ? kLanes : 8;
  typedef Number Lanes __attribute__((vector_size(kLanes * sizeof(Number))));

  alignas(64) Number values[kSize];

  [[gnu::always_inline]] Lanes operator[](IntLanes number) const {
#if defined(__AVX512F__)
    return reinterpret_cast<Lanes>(
        _mm512_permutexvar_epi32(reinterpret_cast<__m512i>(number), _mm512_load_si512(values)));
#elif defined(__AVX2__)
    return reinterpret_cast<Lanes>(_mm256_permutevar8x32_epi32(
        _mm256_load_si256(reinterpret_cast<const __m256i*>(values)), reinterpret_cast<__m256i>(number)));
#else
    Lanes lanes;
    for (int lane = 0; lane < kLanes; ++lane) lanes[lane] = values[number[lane]];
    return lanes;
#endif
  }
};
/// Without its sign.
[[gnu::always_inline]] inline FloatLanes magnitude(FloatLanes x) {
  return reinterpret_cast<FloatLanes>(reinterpret_cast<IntLanes>(x) & 0x7fffffff);
}
/// 0, 1, 2, ...
[[gnu::always_inline]] inline IntLanes countUp() {
  IntLanes lanes;
  for (int lane = 0; lane < kLanes; ++lane) lanes[lane] = lane;
  return lanes;
}

#if defined(__AVX512F__)
[[gnu::always_inline]] inline FloatLanes lesser(FloatLanes a, FloatLanes b) {
  return _mm512_min_ps(a, b);
}
[[gnu::always_inline]] inline FloatLanes greater(FloatLanes a, FloatLanes b) {
  return _mm512_max_ps(a, b);
}
#elif defined(__AVX2__)
[[gnu::always_inline]] inline FloatLanes squareRoot(FloatLanes x) {
  return _mm256_sqrt_ps(x);
}
[[gnu::always_inline]] inline FloatLanes greater(FloatLanes a, FloatLanes b) {
  return _mm256_max_ps(a, b);
}
#else
[[gnu::always_inline]] inline FloatLanes squareRoot(FloatLanes x) {
  for (int lane = 0; lane < kLanes; ++lane) x[lane] = std::sqrt(x[lane]);
  return x;
}
[[gnu::always_inline]] inline FloatLanes greater(FloatLanes a, FloatLanes b) {
  return a > b ? a : b;
}
#endif

/// The first `count` of kLanes numbers, and 0 for the others. @param count may be more.
[[gnu::always_inline]] inline FloatLanes loadFirst(std::int32_t count, const float* from) {
#if defined(__AVX512F__)
  const __mmask16 counts =
      _mm512_cmplt_epi32_mask(reinterpret_cast<__m512i>(countUp()), _mm512_set1_epi32(count));
  return _mm512_maskz_loadu_ps(counts, from);
#else
  const IntLanes counts = countUp() < count;
  return counts ? load(from) : FloatLanes{};
#endif
}

typedef float FourLanes __attribute__((vector_size(16)));

/// Four sums, of kCount numbers each, one behind the other.
template <int kCount>
[[gnu::always_inline]] inline FourLanes sumsOf(const float* numbers) {
  static_assert(4 * kCount == kLanes);
#if defined(__AVX512F__)
  const auto four = [numbers](int n) { return _mm_load_ps(numbers + 4 * n); };
  return _mm_hadd_ps(_mm_hadd_ps(four(0), four(1)), _mm_hadd_ps(four(2), four(3)));
#elif defined(__AVX2__)
  return _mm_hadd_ps(_mm_load_ps(numbers), _mm_load_ps(numbers + 4));
#else
  FourLanes sums;
  __builtin_memcpy(&sums, numbers, sizeof(sums));
  return sums;
#endif
}

/// The sum of some numbers, in a tree.
template <int kCount>
[[gnu::always_inline]] inline float sumOf(const float* numbers) {
  if constexpr (kCount == 1) {
    return numbers[0];
  } else {
    typedef float Half __attribute__((vector_size(kCount / 2 * sizeof(float))));
    Half low, high;
    __builtin_memcpy(&low, numbers, sizeof(low));
    __builtin_memcpy(&high, numbers + kCount / 2, sizeof(high));
    low += high;
    return sumOf<kCount / 2>(reinterpret_cast<const float*>(&low));
  }
}

}  // namespace
}  // namespace bki_mapping
