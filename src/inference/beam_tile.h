/// @file Beams added to tiles of 2 x 2 x 2 voxels; included by beam_loop.h alone.
///
/// With c the unit direction of the tile's centre, r its distance and u a beam's direction, D = c - u is
/// exact (directions are whole numbers), and the offset of the centre from the beam's line is p = r (D +
/// |D|^2 / 2 u), without the cancellation of c - (c u) u. A voxel at o from the tile's centre then has d^2 =
/// |p + o|^2 - (o u)^2.
#pragma once

#include <cmath>

#include "beam_window.h"
#include "bki_mapping/inference/beam_cells.h"
#include "lane_kernel.h"
#include "lane_weight.h"
#include "lanes.h"
#include "picked_beams.h"

namespace bki_mapping {
namespace {

/// A tile's lanes are four voxels of its upper layer times some beams; those of its lower layer are at their
/// opposites.
constexpr int kLayer = 4, kBeamsAtOnce = kLanes / kLayer;

/// Beams near an octant, picked for its tiles: those of a tile one behind the other, from a multiple of
/// kBeamsAtOnce on.
struct TiledBeams {
  static constexpr int kMostOfTile = 256;
  static constexpr int kMost = kOctantTiles * (kMostOfTile + kLanes);
  static constexpr int kAtATime = 16;

  PickedBeams<kMost> beams;
  /// The number in the octant of the tile of each kBeamsAtOnce beams; some more are written at a time.
  alignas(16) unsigned char tile[kMost / kBeamsAtOnce + kAtATime];

  /// Ends a tile's beams. @param first of them.
  [[gnu::always_inline]] void finish(int first, int number) {
    beams.padToMultiple<kBeamsAtOnce>();
    for (int n = first / kBeamsAtOnce; n < beams.count / kBeamsAtOnce; n += kAtATime) {
      __builtin_memset(tile + n, number, kAtATime);
    }
  }
  /// Ends the last tile's.
  void finishAll() {
    beams.pad();
    __builtin_memset(tile + beams.count / kBeamsAtOnce, 0, kAtATime);
  }
};

/// The tiles of an octant. Lengths are in units in which the kernel's scale of squared distances is 1.
struct Tiles {
  Table<std::int32_t> cx, cy, cz;  ///< unit directions of their centres from the sensor [kDirectionStep]
  Table<float> r;                  ///< distances of their centres from the sensor
  float half;                      ///< half a voxel
  float unit;                      ///< [m]

  Tiles(const BeamBlock& block, const Places& places, int octant) {
    unit = block.length / std::sqrt(LaneKernel::kScale);
    half = 0.5f * static_cast<float>(block.resolution) / unit;
    for (int n = 0; n < kOctantTiles; ++n) {
      const int place = Places::firstTile(octant) + n;
      cx.values[n] = places.cx[place];
      cy.values[n] = places.cy[place];
      cz.values[n] = places.cz[place];
      r.values[n] = places.r[place] / unit;
    }
  }
};

/// Beams as seen from their tiles. Lengths are in units of Tiles::unit, but for rho.
struct alignas(64) SeenBeams {
  float constant[kLanes];        ///< |p|^2 + |o|^2, the same for all eight voxels, and the kernel's shift
  float rho[kLanes];             ///< of the tile's centre, less the middle of the weight
  float rho_per_length[kLanes];  ///< change of rho along u
  float x[kLanes], y[kLanes], z[kLanes];     ///< h u, h being half a voxel
  float px[kLanes], py[kLanes], pz[kLanes];  ///< 2 h p
};

template <BeamWeight kWeight>
[[gnu::always_inline]] inline void see(const TiledBeams& picked, int first, const Tiles& tiles,
                                       SeenBeams& seen) {
  const float h = tiles.half;
  const IntLanes tile = repeatBytes<kBeamsAtOnce>(picked.tile + first / kBeamsAtOnce);
  const FloatLanes r = tiles.r[tile], r2 = r * r;
  const IntLanes ux = load(picked.beams.ux + first), uy = load(picked.beams.uy + first),
                 uz = load(picked.beams.uz + first);
  const FloatLanes dx = toFloat(tiles.cx[tile] - ux), dy = toFloat(tiles.cy[tile] - uy),
                   dz = toFloat(tiles.cz[tile] - uz);
  const FloatLanes half_chord2 =
      (0.5f * kDirectionStep * kDirectionStep) * (dx * dx + dy * dy + dz * dz);  // 1 - cos
  const FloatLanes rho_per_length = load(picked.beams.inverse_length + first) * tiles.unit;
  const FloatLanes bend = r * (half_chord2 + half_chord2), scale = r * (2.0f * h * kDirectionStep);
  store(seen.constant, half_chord2 * (r2 + r2 - r2 * half_chord2) + (3.0f * h * h + LaneKernel::kShift));
  store(seen.rho_per_length, rho_per_length);
  store(seen.rho, (r - r * half_chord2) * rho_per_length - Weight<kWeight>::kMiddle);
  const FloatLanes x = toFloat(ux) * (kDirectionStep * h), y = toFloat(uy) * (kDirectionStep * h),
                   z = toFloat(uz) * (kDirectionStep * h);
  store(seen.x, x);
  store(seen.y, y);
  store(seen.z, z);
  store(seen.px, scale * dx + bend * x);
  store(seen.py, scale * dy + bend * y);
  store(seen.pz, scale * dz + bend * z);
}

/// The sums of a tile's voxels, upper and lower layer, each for every lane.
struct alignas(64) TileSums {
  float upper[kLanes], lower[kLanes];
};

/// 1 or -1 in each lane: on which side of the tile's centre its upper voxel is.
struct LaneSides {
  FloatLanes x, y;

  LaneSides() {
    for (int lane = 0; lane < kLanes; ++lane) {
      const int voxel = lane / kBeamsAtOnce;
      x[lane] = (voxel & 1) != 0 ? 1.0f : -1.0f;
      y[lane] = (voxel & 2) != 0 ? 1.0f : -1.0f;
    }
  }
};

/// Adds kBeamsAtOnce beams, from `n` on.
template <BeamWeight kWeight>
[[gnu::always_inline]] inline void addSeen(const SeenBeams& beams, int n, const LaneSides& sides,
                                           const LaneKernel& kernel, TileSums& sums) {
  const auto each = [&](const float* values) { return repeat<kBeamsAtOnce>(values + n); };
  const FloatLanes ou = each(beams.z) + sides.x * each(beams.x) + sides.y * each(beams.y);
  const FloatLanes op2 = each(beams.pz) + sides.x * each(beams.px) + sides.y * each(beams.py);
  const FloatLanes base = each(beams.constant) - ou * ou;
  const FloatLanes rho = each(beams.rho), step = ou * each(beams.rho_per_length);
  store(sums.upper, load(sums.upper) + Weight<kWeight>::at(rho + step) * kernel(base + op2));
  store(sums.lower, load(sums.lower) + Weight<kWeight>::at(rho - step) * kernel(base - op2));
}

/// Adds two sums to those of two voxels side by side.
[[gnu::always_inline]] inline void addTwo(float first, float second, float* voxels) {
  voxels[0] += first;
  voxels[1] += second;
}

/// Adds the sums of a tile's voxels to those of its block.
[[gnu::always_inline]] inline void addTile(const TileSums& tile, float* first_voxel) {
  constexpr int kLayerAbove = kBlockEdge * kBlockEdge;
  const FourLanes upper = sumsOf<kBeamsAtOnce>(tile.upper), lower = sumsOf<kBeamsAtOnce>(tile.lower);
  addTwo(upper[0], upper[1], first_voxel + kLayerAbove);
  addTwo(upper[2], upper[3], first_voxel + kLayerAbove + kBlockEdge);
  addTwo(lower[3], lower[2], first_voxel);
  addTwo(lower[1], lower[0], first_voxel + kBlockEdge);
}

/// Adds the beams of an octant's tiles to the sums of its block.
template <BeamWeight kWeight>
void addTiles(const TiledBeams& picked, const Tiles& tiles, int octant, float* sums) {
  const LaneSides sides;
  const LaneKernel kernel;
  TileSums tile_sums[kOctantTiles] = {};
  for (int first = 0; first < picked.beams.count; first += kLanes) {
    SeenBeams seen;
    see<kWeight>(picked, first, tiles, seen);
    for (int n = 0; n < kLanes; n += kBeamsAtOnce) {
      addSeen<kWeight>(seen, n, sides, kernel, tile_sums[picked.tile[(first + n) / kBeamsAtOnce]]);
    }
  }
  for (int n = 0; n < kOctantTiles; ++n) addTile(tile_sums[n], sums + firstVoxel(octant, n));
}

}  // namespace
}  // namespace bki_mapping
