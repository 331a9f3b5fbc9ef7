/// @file The innermost loop of line evidence; each instruction set's file includes it and gets a copy of its
/// own. A block is cut into eight octants of 4 x 4 x 4 voxels, and these into tiles of 2 x 2 x 2. The beams
/// near an octant are picked from a few slices of the table, of these the beams near each of its tiles, and
/// these are added to the tile's eight voxels, several beams side by side.
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
#include "lanes.h"
#include "voxel_loop.h"

namespace bki_mapping {
namespace {

static_assert(kLanes <= static_cast<int>(kBeamPadding));

/// Beams near an octant or a tile.
struct PickedBeams {
  static constexpr int kMost = 1024;

  alignas(64) std::int32_t ux[kMost + kLanes], uy[kMost + kLanes], uz[kMost + kLanes];
  alignas(64) float inverse_length[kMost + kLanes];
  int count = 0;

  /// Fills the last lanes that loops look at with beams that have no weight.
  void pad() {
    for (int n = count; n < count + kLanes; ++n) {
      ux[n] = uy[n] = uz[n] = 0;
      inverse_length[n] = 0.0f;
    }
  }
};

/// Appends those of kLanes beams that are to be kept. @param keep -1 or 0.
[[gnu::always_inline]] inline void append(const std::int32_t* ux, const std::int32_t* uy,
                                          const std::int32_t* uz, const float* inverse_length, IntLanes keep,
                                          PickedBeams& picked) {
  const int n = picked.count;
#if defined(__AVX512F__)
  const __mmask16 mask = _mm512_movepi32_mask(reinterpret_cast<__m512i>(keep));
  _mm512_storeu_si512(picked.ux + n, _mm512_maskz_compress_epi32(mask, _mm512_loadu_si512(ux)));
  _mm512_storeu_si512(picked.uy + n, _mm512_maskz_compress_epi32(mask, _mm512_loadu_si512(uy)));
  _mm512_storeu_si512(picked.uz + n, _mm512_maskz_compress_epi32(mask, _mm512_loadu_si512(uz)));
  _mm512_storeu_ps(picked.inverse_length + n,
                   _mm512_maskz_compress_ps(mask, _mm512_loadu_ps(inverse_length)));
  picked.count = n + __builtin_popcount(mask);
#else
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

/// A tile and some beams near it. Lengths are in units of the kernel's length, but for rho.
struct TileAndBeams {
  FloatLanes constant;        ///< |p|^2 + |o|^2, the same for all eight voxels
  FloatLanes rho;             ///< of the tile's centre
  FloatLanes rho_per_length;  ///< change of rho along u
};

/// Adds the values of two voxels on opposite sides of the tile's centre, at -o and o.
/// @param ou o u. @param op2 2 o p.
template <BeamWeight kWeight>
[[gnu::always_inline]] inline void addPair(const TileAndBeams& b, FloatLanes ou, FloatLanes op2,
                                           float* before, float* behind) {
  const FloatLanes base = b.constant - ou * ou, step = ou * b.rho_per_length;
  // Rounding may make squares negative.
  const FloatLanes r0 = squareRoot(greater(base - op2, FloatLanes{})),
                   r1 = squareRoot(greater(base + op2, FloatLanes{}));
  const FloatLanes k0 = sparseKernel(r0, greater(1.0f - r0, FloatLanes{})),
                   k1 = sparseKernel(r1, greater(1.0f - r1, FloatLanes{}));
  store(before, load(before) + weightAt<kWeight>(b.rho - step) * k0);
  store(behind, load(behind) + weightAt<kWeight>(b.rho + step) * k1);
}

/// Adds kLanes beams, from `first` on, to the sums of a tile's voxels, lane by lane: voxel v's lanes are
/// lanes[v * kLanes ...].
template <BeamWeight kWeight>
[[gnu::always_inline]] inline void addPicked(const PickedBeams& picked, int first, const Tile& tile,
                                             float* lanes) {
  const float h = tile.half;
  const IntLanes iux = load(picked.ux + first), iuy = load(picked.uy + first), iuz = load(picked.uz + first);
  const FloatLanes dx = toFloat(tile.cx - iux) * kDirectionStep, dy = toFloat(tile.cy - iuy) * kDirectionStep,
                   dz = toFloat(tile.cz - iuz) * kDirectionStep;
  const FloatLanes half_chord2 = 0.5f * (dx * dx + dy * dy + dz * dz);  // 1 - cos
  TileAndBeams b;
  b.constant = 2.0f * tile.r * tile.r * half_chord2 * (1.0f - 0.5f * half_chord2) + 3.0f * h * h;
  b.rho_per_length = load(picked.inverse_length + first) * tile.length;
  b.rho = tile.r * (1.0f - half_chord2) * b.rho_per_length;
  // h u and 2 h p, axis by axis.
  const float step = kDirectionStep * h, scale = 2.0f * h * tile.r;
  const FloatLanes x = toFloat(iux) * step, y = toFloat(iuy) * step, z = toFloat(iuz) * step;
  const FloatLanes bend = 2.0f * tile.r * half_chord2;
  const FloatLanes px = scale * dx + bend * x, py = scale * dy + bend * y, pz = scale * dz + bend * z;
  const FloatLanes sum = y + x, difference = y - x, p_sum = py + px, p_difference = py - px;
  addPair<kWeight>(b, z + sum, pz + p_sum, lanes, lanes + 7 * kLanes);
  addPair<kWeight>(b, z + difference, pz + p_difference, lanes + kLanes, lanes + 6 * kLanes);
  addPair<kWeight>(b, z - difference, pz - p_difference, lanes + 2 * kLanes, lanes + 5 * kLanes);
  addPair<kWeight>(b, z - sum, pz - p_sum, lanes + 3 * kLanes, lanes + 4 * kLanes);
}

/// Picks those of kLanes beams that may reach a place between the sensor and their end.
/// @param left how many of them count.
[[gnu::always_inline]] inline void pick(const std::int32_t* ux, const std::int32_t* uy,
                                        const std::int32_t* uz, const float* inverse_length,
                                        std::int32_t left, const Place& place, PickedBeams& picked) {
  const FloatLanes dx = toFloat(place.cx - load(ux)), dy = toFloat(place.cy - load(uy)),
                   dz = toFloat(place.cz - load(uz));
  const FloatLanes chord2 = dx * dx + dy * dy + dz * dz;
  const IntLanes keep =
      (chord2 < place.chord2) & (place.nearest * load(inverse_length) < 1.0f) & (countUp() < left);
  append(ux, uy, uz, inverse_length, keep, picked);
}

/// Adds the sums of a tile's voxels to those of its block.
void addTile(const Tile& tile, const float* lanes, float* sums) {
  for (int v = 0; v < 8; ++v) {
    const int offset = (v & 1) + kBlockEdge * ((v >> 1 & 1) + kBlockEdge * (v >> 2));
    sums[tile.first_voxel + offset] += sumOf<kLanes>(lanes + v * kLanes);
  }
}

/// Adds the beams picked for an octant to its tiles, and forgets them.
template <BeamWeight kWeight>
void addOctant(const BeamBlock& block, const Places& places, int octant, PickedBeams& near_octant,
               float* sums) {
  PickedBeams near_tile;
  near_octant.pad();
  for (int n = 0; n < 8; ++n) {
    const int number = tileInOctant(octant, n);
    const Place place = places.tile(number);
    near_tile.count = 0;
    for (int b = 0; b < near_octant.count; b += kLanes) {
      pick(near_octant.ux + b, near_octant.uy + b, near_octant.uz + b, near_octant.inverse_length + b,
           near_octant.count - b, place, near_tile);
    }
    if (near_tile.count == 0) continue;
    const Tile tile = tileOf(block, places, number);
    alignas(64) float lanes[8 * kLanes] = {};
    near_tile.pad();
    for (int b = 0; b < near_tile.count; b += kLanes) addPicked<kWeight>(near_tile, b, tile, lanes);
    addTile(tile, lanes, sums);
  }
  near_octant.count = 0;
}

/// Adds the beams of a block. @param addAlone called as addAlone(octant) may add the octant, and tells
/// whether it has.
/// @param forEachRangeOf called as forEachRangeOf(octant, visit) shall call visit(range) for the ranges in
/// which the octant's beams are.
template <BeamWeight kWeight, typename AddAlone, typename ForEachRange>
[[gnu::always_inline]] inline void addBlock(const BeamArrays& beams, const BeamBlock& block, float* sums,
                                            AddAlone&& addAlone, ForEachRange&& forEachRangeOf) {
  Places places;
  findPlaces(block, places);
  PickedBeams near_octant;
  for (int octant = 0; octant < 8; ++octant) {
    if (addAlone(octant)) continue;
    const Place place = places.octant(octant);
    forEachRangeOf(octant, [&](BeamRange range) {
      for (std::uint32_t b = range.first; b < range.last; b += kLanes) {
        pick(beams.ux + b, beams.uy + b, beams.uz + b, beams.inverse_length + b,
             static_cast<std::int32_t>(range.last - b), place, near_octant);
        if (near_octant.count > PickedBeams::kMost - kLanes) {
          addOctant<kWeight>(block, places, octant, near_octant, sums);
        }
      }
    });
    if (near_octant.count > 0) addOctant<kWeight>(block, places, octant, near_octant, sums);
  }
}

template <BeamWeight kWeight>
void addWeightedBeams(const BeamArrays& beams, const BeamBlock& block, float* sums) {
  Windows<kOctants> windows;
  findWindows(block, windows);
  const auto addAlone = [&](int octant) {
    std::uint32_t count = 0;
    forEachRange(beams.begin, windows, octant, [&](BeamRange range) { count += range.last - range.first; });
    if (count < kManyBeams) return false;
    addOctantByVoxels<kWeight>(beams, block, octant, sums);
    return true;
  };
  addBlock<kWeight>(beams, block, sums, addAlone,
                    [&](int octant, auto&& visit) { forEachRange(beams.begin, windows, octant, visit); });
}

template <BeamWeight kWeight>
void addSomeWeightedBeams(const BeamArrays& beams, const BeamRange* ranges, std::size_t count,
                          const BeamBlock& block, float* sums) {
  addBlock<kWeight>(
      beams, block, sums, [](int) { return false; },
      [&](int, auto&& visit) {
        for (std::size_t n = 0; n < count; ++n) visit(ranges[n]);
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
