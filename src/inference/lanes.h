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
/// 0, 1, 2, ...
[[gnu::always_inline]] inline IntLanes countUp() {
  IntLanes lanes;
  for (int lane = 0; lane < kLanes; ++lane) lanes[lane] = lane;
  return lanes;
}

#if defined(__AVX512F__)
[[gnu::always_inline]] inline FloatLanes squareRoot(FloatLanes x) {
  return _mm512_sqrt_ps(x);
}
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
[[gnu::always_inline]] inline FloatLanes lesser(FloatLanes a, FloatLanes b) {
  return _mm256_min_ps(a, b);
}
[[gnu::always_inline]] inline FloatLanes greater(FloatLanes a, FloatLanes b) {
  return _mm256_max_ps(a, b);
}
#else
[[gnu::always_inline]] inline FloatLanes squareRoot(FloatLanes x) {
  for (int lane = 0; lane < kLanes; ++lane) x[lane] = std::sqrt(x[lane]);
  return x;
}
[[gnu::always_inline]] inline FloatLanes lesser(FloatLanes a, FloatLanes b) {
  return a < b ? a : b;
}
[[gnu::always_inline]] inline FloatLanes greater(FloatLanes a, FloatLanes b) {
  return a > b ? a : b;
}
#endif

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
