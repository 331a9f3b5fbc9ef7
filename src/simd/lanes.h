/// @file Several numbers side by side, in GCC's vector extension (which Clang has too): arithmetic is written
/// as for one number. Included by the inner loops alone, whose files set kLanes by their instruction set.
#pragma once

#include <cmath>
#include <cstdint>
#if defined(__SSE__)
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
[[gnu::always_inline]] inline void store(std::int32_t* to, IntLanes lanes) {
  __builtin_memcpy(to, &lanes, sizeof(lanes));
}
[[gnu::always_inline]] inline FloatLanes toFloat(IntLanes lanes) {
  return __builtin_convertvector(lanes, FloatLanes);
}
/// Towards 0.
[[gnu::always_inline]] inline IntLanes toInt(FloatLanes lanes) {
  return __builtin_convertvector(lanes, IntLanes);
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

/// The lesser of two magnitudes.
[[gnu::always_inline]] inline FloatLanes lesserMagnitude(FloatLanes a, FloatLanes b) {
#if defined(__AVX512F__)
  constexpr int kLesserWithoutSign = 0b1010;
  return _mm512_range_ps(a, b, kLesserWithoutSign);
#else
  return lesser(magnitude(a), magnitude(b));
#endif
}

/// Whether any lane is set, all lanes being 0 or -1.
[[gnu::always_inline]] inline bool anyOf(IntLanes lanes) {
#if defined(__AVX512F__)
  return _mm512_movepi32_mask(reinterpret_cast<__m512i>(lanes)) != 0;
#elif defined(__AVX2__)
  return _mm256_movemask_ps(reinterpret_cast<__m256>(lanes)) != 0;
#else
  std::int32_t any = 0;
  for (int lane = 0; lane < kLanes; ++lane) any |= lanes[lane];
  return any != 0;
#endif
}

/// kCount numbers side by side.
template <int kCount>
struct Part {
  typedef float Lanes __attribute__((vector_size(kCount * sizeof(float))));
};

/// The n-th kCount lanes.
template <int kCount>
[[gnu::always_inline]] inline typename Part<kCount>::Lanes part(FloatLanes lanes, [[maybe_unused]] int n) {
  if constexpr (kCount == kLanes) {
    return lanes;
  } else {
#if defined(__AVX512F__)
    if constexpr (kCount == 8) {
      return n == 0 ? _mm512_castps512_ps256(lanes) : _mm512_extractf32x8_ps(lanes, 1);
    } else {
      switch (n) {
        case 0:
          return _mm512_castps512_ps128(lanes);
        case 1:
          return _mm512_extractf32x4_ps(lanes, 1);
        case 2:
          return _mm512_extractf32x4_ps(lanes, 2);
        default:
          return _mm512_extractf32x4_ps(lanes, 3);
      }
    }
#elif defined(__AVX2__)
    return n == 0 ? _mm256_castps256_ps128(lanes) : _mm256_extractf128_ps(lanes, 1);
#endif
  }
}

/// Stores the lanes of a and b by pairs; where the pair of a lane then is, pairOf says: that
/// of an odd lane stands behind the one before.
[[gnu::always_inline]] inline void storePairs(float* to, FloatLanes a, FloatLanes b) {
#if defined(__AVX512F__)
  store(to, static_cast<FloatLanes>(_mm512_unpacklo_ps(a, b)));
  store(to + kLanes, static_cast<FloatLanes>(_mm512_unpackhi_ps(a, b)));
#elif defined(__AVX2__)
  store(to, static_cast<FloatLanes>(_mm256_unpacklo_ps(a, b)));
  store(to + kLanes, static_cast<FloatLanes>(_mm256_unpackhi_ps(a, b)));
#elif defined(__SSE__)
  store(to, static_cast<FloatLanes>(_mm_unpacklo_ps(a, b)));
  store(to + kLanes, static_cast<FloatLanes>(_mm_unpackhi_ps(a, b)));
#else
  for (int lane = 0; lane < kLanes; ++lane) {
    to[2 * lane] = a[lane];
    to[2 * lane + 1] = b[lane];
  }
#endif
}
constexpr int pairOf(int lane) {
#if defined(__SSE__)
  return lane / 4 * 4 + lane % 2 * 2 + lane % 4 / 2 * kLanes;  // by quarters of what unpacking gives
#else
  return 2 * lane;
#endif
}

/// Stores four numbers of each lane side by side; where those of a lane then are, fourOf says.
template <typename Number, typename Lanes>
[[gnu::always_inline]] inline void storeFours(Number* to, const Lanes (&numbers)[4]) {
#if defined(__AVX512F__)
  const auto n = [&](int k) { return reinterpret_cast<__m512i>(numbers[k]); };
  const __m512i low[2] = {_mm512_unpacklo_epi32(n(0), n(1)), _mm512_unpacklo_epi32(n(2), n(3))},
                high[2] = {_mm512_unpackhi_epi32(n(0), n(1)), _mm512_unpackhi_epi32(n(2), n(3))};
  _mm512_storeu_si512(to, _mm512_unpacklo_epi64(low[0], low[1]));
  _mm512_storeu_si512(to + kLanes, _mm512_unpackhi_epi64(low[0], low[1]));
  _mm512_storeu_si512(to + 2 * kLanes, _mm512_unpacklo_epi64(high[0], high[1]));
  _mm512_storeu_si512(to + 3 * kLanes, _mm512_unpackhi_epi64(high[0], high[1]));
#elif defined(__AVX2__)
  const auto n = [&](int k) { return reinterpret_cast<__m256i>(numbers[k]); };
  const auto put = [&](int k, __m256i four) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + k * kLanes), four);
  };
  const __m256i low[2] = {_mm256_unpacklo_epi32(n(0), n(1)), _mm256_unpacklo_epi32(n(2), n(3))},
                high[2] = {_mm256_unpackhi_epi32(n(0), n(1)), _mm256_unpackhi_epi32(n(2), n(3))};
  put(0, _mm256_unpacklo_epi64(low[0], low[1]));
  put(1, _mm256_unpackhi_epi64(low[0], low[1]));
  put(2, _mm256_unpacklo_epi64(high[0], high[1]));
  put(3, _mm256_unpackhi_epi64(high[0], high[1]));
#else
  for (int lane = 0; lane < kLanes; ++lane) {
    for (int k = 0; k < 4; ++k) to[4 * lane + k] = numbers[k][lane];
  }
#endif
}
constexpr int fourOf(int lane) {
#if defined(__AVX2__)
  return lane % 4 * kLanes + lane / 4 * 4;  // by quarters of what unpacking gives
#else
  return 4 * lane;
#endif
}

/// Adds two numbers each to two places that share nothing.
[[gnu::always_inline]] inline void addPairs(float* a, float* b, Part<4>::Lanes numbers) {
#if defined(__SSE__)
  __m64 *const first = reinterpret_cast<__m64*>(a), *const second = reinterpret_cast<__m64*>(b);
  const __m128 sums =
      _mm_loadh_pi(_mm_loadl_pi(_mm_setzero_ps(), first), second) + static_cast<__m128>(numbers);
  _mm_storel_pi(first, sums);
  _mm_storeh_pi(second, sums);
#else
  for (int n = 0; n < 2; ++n) {
    a[n] += numbers[n];
    b[n] += numbers[2 + n];
  }
#endif
}

/// Adds numbers side by side to others.
template <typename Lanes>
[[gnu::always_inline]] inline void addTo(float* to, Lanes numbers) {
  Lanes sums;
  __builtin_memcpy(&sums, to, sizeof(sums));
  sums += numbers;
  __builtin_memcpy(to, &sums, sizeof(sums));
}

}  // namespace
}  // namespace bki_mapping
