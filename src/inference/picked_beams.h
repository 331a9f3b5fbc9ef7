/// @file Beams near a place, picked from others; included by beam_loop.h and what it includes alone.
#pragma once

#include "beam_window.h"
#include "bki_mapping/inference/beam_cells.h"
#include "lanes.h"

namespace bki_mapping {
namespace {

static_assert(kLanes <= static_cast<int>(kBeamPadding));

/// Up to kCapacity beams, and room for as many more as loops write or look at behind the last.
template <int kCapacity>
struct PickedBeams {
  static constexpr int kMost = kCapacity;

  alignas(64) std::int32_t ux[kMost + kLanes], uy[kMost + kLanes], uz[kMost + kLanes];
  alignas(64) float inverse_length[kMost + kLanes];
  int count = 0;

  /// Fills the lanes behind the last beam with beams that have no weight.
  void pad() {
    for (int n = count; n < count + kLanes; ++n) setNone(n);
  }
  /// Rounds the count up to a multiple, with beams that have no weight, whatever their directions.
  template <int kMultiple>
  [[gnu::always_inline]] void padToMultiple() {
    __builtin_memset(inverse_length + count, 0, kMultiple * sizeof(float));
    count = (count + kMultiple - 1) / kMultiple * kMultiple;
  }
  /// Makes the n-th a beam that has no weight.
  void setNone(int n) {
    ux[n] = uy[n] = uz[n] = 0;
    inverse_length[n] = 0.0f;
  }
};

/// Some beams, one behind the other in each array.
struct BeamsAt {
  const std::int32_t *ux, *uy, *uz;
  const float* inverse_length;

  explicit BeamsAt(const BeamArrays& beams, std::uint32_t first)
      : ux(beams.ux + first),
        uy(beams.uy + first),
        uz(beams.uz + first),
        inverse_length(beams.inverse_length + first) {}
  template <int kCapacity>
  explicit BeamsAt(const PickedBeams<kCapacity>& beams, int first)
      : ux(beams.ux + first),
        uy(beams.uy + first),
        uz(beams.uz + first),
        inverse_length(beams.inverse_length + first) {}
};

/// Appends those of kLanes beams that may reach a place between the sensor and their end.
/// @param left how many of them count.
template <int kCapacity>
[[gnu::always_inline]] inline void pick(const BeamsAt& beams, std::int32_t left, const Place& place,
                                        PickedBeams<kCapacity>& picked) {
  const IntLanes ux = load(beams.ux), uy = load(beams.uy), uz = load(beams.uz);
  const FloatLanes inverse_length = load(beams.inverse_length);
  const FloatLanes dx = toFloat(place.cx - ux), dy = toFloat(place.cy - uy), dz = toFloat(place.cz - uz);
  const FloatLanes chord2 = dx * dx + dy * dy + dz * dz, nearest = place.nearest * inverse_length;
  const int n = picked.count;
#if defined(__AVX512F__)
  const __mmask16 counts =
      _mm512_cmplt_epi32_mask(reinterpret_cast<__m512i>(countUp()), _mm512_set1_epi32(left));
  const __mmask16 keep = _mm512_mask_cmp_ps_mask(
      _mm512_mask_cmp_ps_mask(counts, chord2, _mm512_set1_ps(place.chord2), _CMP_LT_OS), nearest,
      _mm512_set1_ps(1.0f), _CMP_LT_OS);
  const auto kept = [keep](auto lanes) {
    return _mm512_maskz_compress_epi32(keep, reinterpret_cast<__m512i>(lanes));
  };
  _mm512_storeu_si512(picked.ux + n, kept(ux));
  _mm512_storeu_si512(picked.uy + n, kept(uy));
  _mm512_storeu_si512(picked.uz + n, kept(uz));
  _mm512_storeu_si512(picked.inverse_length + n, kept(inverse_length));
  picked.count = n + __builtin_popcount(keep);
#else
  const IntLanes keep = (chord2 < place.chord2) & (nearest < 1.0f) & (countUp() < left);
  int end = n;
  for (int lane = 0; lane < kLanes; ++lane) {
    picked.ux[end] = ux[lane];
    picked.uy[end] = uy[lane];
    picked.uz[end] = uz[lane];
    picked.inverse_length[end] = inverse_length[lane];
    end -= keep[lane];
  }
  picked.count = end;
#endif
}

}  // namespace
}  // namespace bki_mapping
