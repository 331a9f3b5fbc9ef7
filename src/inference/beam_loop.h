/// @file The innermost loop of line evidence; each instruction set's file includes it and gets a copy of its
/// own. A block is cut into tiles of 2 x 2 x 2 voxels. For each tile the beams near it are picked from a few
/// slices of the table, then added to its eight voxels, several beams side by side.
///
/// With c the unit direction of a tile's centre, r its distance and u a beam's direction, D = c - u is exact
/// (directions are whole numbers), and the offset of the centre from the beam's line is
/// p = r (D + |D|^2 / 2 u), without the cancellation of c - (c u) u. A voxel at o from the tile's centre then
/// has d^2 = |p + o|^2 - (o u)^2.
#pragma once

#include "beam_window.h"
#include "bki_mapping/core/config.h"
#include "bki_mapping/inference/beam_cells.h"
#include "bki_mapping/inference/kernel.h"
#if defined(__AVX512F__)
#include <immintrin.h>
#endif

namespace bki_mapping {
namespace {

/// Beams that are added side by side.
#if defined(__AVX512F__)
constexpr int kLanes = 16;
#else
constexpr int kLanes = 8;
#endif
static_assert(kLanes <= static_cast<int>(kBeamPadding));

/// Beams near a tile.
struct PickedBeams {
  static constexpr int kMost = 512;

  alignas(64) std::int32_t ux[kMost + kLanes], uy[kMost + kLanes], uz[kMost + kLanes];
  alignas(64) float inverse_length[kMost + kLanes];
  int count = 0;
};

/// Appends those of kLanes beams that are to be kept.
[[gnu::always_inline]] inline void append(const std::int32_t* ux, const std::int32_t* uy,
                                          const std::int32_t* uz, const float* inverse_length,
                                          const std::int32_t* keep, PickedBeams& picked) {
#if defined(__AVX512F__)
  const __mmask16 mask = _mm512_test_epi32_mask(_mm512_loadu_si512(keep), _mm512_loadu_si512(keep));
  const int n = picked.count;
  _mm512_storeu_si512(picked.ux + n, _mm512_maskz_compress_epi32(mask, _mm512_loadu_si512(ux)));
  _mm512_storeu_si512(picked.uy + n, _mm512_maskz_compress_epi32(mask, _mm512_loadu_si512(uy)));
  _mm512_storeu_si512(picked.uz + n, _mm512_maskz_compress_epi32(mask, _mm512_loadu_si512(uz)));
  _mm512_storeu_ps(picked.inverse_length + n,
                   _mm512_maskz_compress_ps(mask, _mm512_loadu_ps(inverse_length)));
  picked.count += __builtin_popcount(mask);
#else
  for (int lane = 0; lane < kLanes; ++lane) {
    const int n = picked.count;
    picked.ux[n] = ux[lane];
    picked.uy[n] = uy[lane];
    picked.uz[n] = uz[lane];
    picked.inverse_length[n] = inverse_length[lane];
    picked.count += keep[lane] != 0;
  }
#endif
}

/// Weight along a beam, 0 unless 0 < rho < 1.
template <BeamWeight kWeight>
[[gnu::always_inline]] inline float weightAt(float rho) {
  if (kWeight == BeamWeight::kBilinear) {
    const float least = rho < 1.0f - rho ? rho : 1.0f - rho;
    return least > 0.0f ? least : 0.0f;
  }
  const float weight = kWeight == BeamWeight::kUniform ? 1.0f : rho;
  return (rho > 0.0f) & (rho < 1.0f) ? weight : 0.0f;
}

/// A tile and one beam near it. Lengths are in units of the kernel's length, but for rho.
struct TileAndBeam {
  float px, py, pz, ux, uy, uz;
  float constant;        ///< |p|^2 + |o|^2, the same for all eight voxels
  float rho;             ///< of the tile's centre
  float rho_per_length;  ///< change of rho along u
  float half;            ///< half a voxel
};

/// The value of one voxel of the tile; the signs say on which side of the centre it lies.
template <BeamWeight kWeight, int kX, int kY, int kZ>
[[gnu::always_inline]] inline float valueAt(const TileAndBeam& b) {
  const float along = b.half * (kX * b.ux + kY * b.uy + kZ * b.uz);
  const float t = b.constant + 2.0f * b.half * (kX * b.px + kY * b.py + kZ * b.pz) - along * along;
  return weightAt<kWeight>(b.rho + along * b.rho_per_length) * sparseKernel(t > 0.0f ? t : 0.0f);
}

/// Adds kLanes beams, from `first` on, to the sums of a tile's voxels, lane by lane: voxel v's lanes are
/// lanes[v * kLanes ...].
template <BeamWeight kWeight>
[[gnu::always_inline]] inline void addPicked(const PickedBeams& picked, int first, const Tile& tile,
                                             float* lanes) {
  const std::int32_t *ux = picked.ux + first, *uy = picked.uy + first, *uz = picked.uz + first;
  const float* inverse_length = picked.inverse_length + first;
  for (int lane = 0; lane < kLanes; ++lane) {
    TileAndBeam b;
    const float dx = static_cast<float>(tile.cx - ux[lane]) * kDirectionStep,
                dy = static_cast<float>(tile.cy - uy[lane]) * kDirectionStep,
                dz = static_cast<float>(tile.cz - uz[lane]) * kDirectionStep;
    b.ux = static_cast<float>(ux[lane]) * kDirectionStep;
    b.uy = static_cast<float>(uy[lane]) * kDirectionStep;
    b.uz = static_cast<float>(uz[lane]) * kDirectionStep;
    const float half_chord2 = 0.5f * (dx * dx + dy * dy + dz * dz);  // 1 - cos
    b.px = tile.r * (dx + half_chord2 * b.ux);
    b.py = tile.r * (dy + half_chord2 * b.uy);
    b.pz = tile.r * (dz + half_chord2 * b.uz);
    b.half = tile.half;
    b.constant = b.px * b.px + b.py * b.py + b.pz * b.pz + 3.0f * tile.half * tile.half;
    b.rho_per_length = inverse_length[lane] * tile.length;
    b.rho = tile.r * (1.0f - half_chord2) * b.rho_per_length;
    lanes[lane] += valueAt<kWeight, -1, -1, -1>(b);
    lanes[lane + kLanes] += valueAt<kWeight, 1, -1, -1>(b);
    lanes[lane + 2 * kLanes] += valueAt<kWeight, -1, 1, -1>(b);
    lanes[lane + 3 * kLanes] += valueAt<kWeight, 1, 1, -1>(b);
    lanes[lane + 4 * kLanes] += valueAt<kWeight, -1, -1, 1>(b);
    lanes[lane + 5 * kLanes] += valueAt<kWeight, 1, -1, 1>(b);
    lanes[lane + 6 * kLanes] += valueAt<kWeight, -1, 1, 1>(b);
    lanes[lane + 7 * kLanes] += valueAt<kWeight, 1, 1, 1>(b);
  }
}

/// Adds all picked beams, and forgets them.
template <BeamWeight kWeight>
void flush(const Tile& tile, PickedBeams& picked, float* lanes) {
  for (int lane = 0; lane < kLanes; ++lane) picked.inverse_length[picked.count + lane] = 0.0f;  // no weight
  for (int first = 0; first < picked.count; first += kLanes) {
    addPicked<kWeight>(picked, first, tile, lanes);
  }
  picked.count = 0;
}

/// Picks the beams of a range that may reach a tile between the sensor and their end.
/// @return whether beams had to be flushed to make room.
template <BeamWeight kWeight>
[[gnu::always_inline]] inline bool pick(const BeamArrays& beams, BeamRange range, const Tile& tile,
                                        PickedBeams& picked, float* lanes) {
  // The chord at which a line passes the tile's ball, [kDirectionStep^2].
  const float s2 = tile.radius * tile.radius / (tile.r * tile.r);
  const float most =
      (s2 < 1.0f ? 2.0f - 2.0f * std::sqrt(1.0f - s2) : 4.0f) * 1.0001f / (kDirectionStep * kDirectionStep);
  const float nearest = (tile.r - tile.radius) * tile.length;
  bool flushed = false;
  for (std::uint32_t first = range.first; first < range.last; first += kLanes) {
    const auto left = static_cast<std::int32_t>(range.last - first);
    const std::int32_t *ux = beams.ux + first, *uy = beams.uy + first, *uz = beams.uz + first;
    const float* inverse_length = beams.inverse_length + first;
    alignas(64) std::int32_t keep[kLanes];
    for (int lane = 0; lane < kLanes; ++lane) {
      const auto dx = static_cast<float>(tile.cx - ux[lane]), dy = static_cast<float>(tile.cy - uy[lane]),
                 dz = static_cast<float>(tile.cz - uz[lane]);
      const float chord2 = dx * dx + dy * dy + dz * dz;
      keep[lane] = (chord2 < most) & (nearest * inverse_length[lane] < 1.0f) & (lane < left);
    }
    append(ux, uy, uz, inverse_length, keep, picked);
    if (picked.count < PickedBeams::kMost - kLanes) continue;
    flush<kWeight>(tile, picked, lanes);
    flushed = true;
  }
  return flushed;
}

template <int kCount>
struct FloatVector {
  using Type [[gnu::vector_size(kCount * sizeof(float))]] = float;
};

/// The sum of some lanes, in a tree.
template <int kCount>
[[gnu::always_inline]] inline float sumOf(const float* lanes) {
  if constexpr (kCount == 1) {
    return lanes[0];
  } else {
    typename FloatVector<kCount / 2>::Type low, high;
    __builtin_memcpy(&low, lanes, sizeof(low));
    __builtin_memcpy(&high, lanes + kCount / 2, sizeof(high));
    low += high;
    return sumOf<kCount / 2>(reinterpret_cast<const float*>(&low));
  }
}

/// Adds the sums of a tile's voxels to those of its block.
void addTile(const Tile& tile, const float* lanes, float* sums) {
  for (int v = 0; v < 8; ++v) {
    const int offset = (v & 1) + kBlockEdge * ((v >> 1 & 1) + kBlockEdge * (v >> 2));
    sums[tile.first_voxel + offset] += sumOf<kLanes>(lanes + v * kLanes);
  }
}

/// Adds the beams of a block. @param pickAll called as pickAll(tile number, tile, pick) shall call
/// pick(range) for the ranges in which the tile's beams are.
template <BeamWeight kWeight, typename PickAll>
[[gnu::always_inline]] inline void addTiles(const BeamArrays& beams, const BeamBlock& block, float* sums,
                                            PickAll&& pickAll) {
  PickedBeams picked;
  for (int number = 0; number < kTiles; ++number) {
    const Tile tile = tileOf(block, number);
    alignas(64) float lanes[8 * kLanes] = {};
    bool flushed = false;
    pickAll(number, tile,
            [&](BeamRange range) { flushed |= pick<kWeight>(beams, range, tile, picked, lanes); });
    if (!flushed && picked.count == 0) continue;
    flush<kWeight>(tile, picked, lanes);
    addTile(tile, lanes, sums);
  }
}

template <BeamWeight kWeight>
void addWeightedBeams(const BeamArrays& beams, const BeamBlock& block, float* sums) {
  TileWindows windows;
  findWindows(block, windows);
  addTiles<kWeight>(beams, block, sums, [&](int number, const Tile&, auto&& pick) {
    const int first = windows.first_column[number], last = windows.last_column[number];
    for (int row = windows.first_row[number]; row <= windows.last_row[number]; ++row) {
      const std::uint32_t* begin = beams.begin + row * kBeamColumns;
      if (first <= last) {
        if (begin[first] < begin[last + 1]) pick({begin[first], begin[last + 1]});
      } else {  // over the seam
        pick({begin[first], begin[kBeamColumns]});
        pick({begin[0], begin[last + 1]});
      }
    }
  });
}

template <BeamWeight kWeight>
void addSomeWeightedBeams(const BeamArrays& beams, const BeamRange* ranges, std::size_t count,
                          const BeamBlock& block, float* sums) {
  addTiles<kWeight>(beams, block, sums, [&](int, const Tile&, auto&& pick) {
    for (std::size_t n = 0; n < count; ++n) pick(ranges[n]);
  });
}

void addBeamsLoop(const BeamArrays& beams, const BeamBlock& block, BeamWeight weight, float* sums) {
  switch (weight) {
    case BeamWeight::kUniform:
      return addWeightedBeams<BeamWeight::kUniform>(beams, block, sums);
    case BeamWeight::kLinear:
      return addWeightedBeams<BeamWeight::kLinear>(beams, block, sums);
    case BeamWeight::kBilinear:
      return addWeightedBeams<BeamWeight::kBilinear>(beams, block, sums);
  }
}

void addSomeBeamsLoop(const BeamArrays& beams, const BeamRange* ranges, std::size_t count,
                      const BeamBlock& block, BeamWeight weight, float* sums) {
  switch (weight) {
    case BeamWeight::kUniform:
      return addSomeWeightedBeams<BeamWeight::kUniform>(beams, ranges, count, block, sums);
    case BeamWeight::kLinear:
      return addSomeWeightedBeams<BeamWeight::kLinear>(beams, ranges, count, block, sums);
    case BeamWeight::kBilinear:
      return addSomeWeightedBeams<BeamWeight::kBilinear>(beams, ranges, count, block, sums);
  }
}

}  // namespace
}  // namespace bki_mapping
