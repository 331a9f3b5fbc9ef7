/// @file The tiles of a block as seen from the sensor, and the cells of the beams near each; included by
/// beam_loop.h alone.
#pragma once

#include "bki_mapping/core/types.h"
#include "bki_mapping/inference/beam_block.h"
#include "bki_mapping/inference/beam_cells.h"

namespace bki_mapping {
namespace {

/// Tiles of 2 x 2 x 2 voxels: a side, and in all.
constexpr int kTileEdge = kBlockEdge / 2;
constexpr int kTiles = kTileEdge * kTileEdge * kTileEdge;

/// A tile. Lengths are in units of the kernel's length.
struct Tile {
  std::int32_t cx, cy, cz;  ///< unit direction of its centre from the sensor [kDirectionStep]
  float r;                  ///< distance of its centre from the sensor
  float half;               ///< half a voxel
  float radius;             ///< about its centre, of the lines that reach any of its voxels
  float length;             ///< of the kernel [m]
  int first_voxel;          ///< place in the block
};

/// The centre of a tile relative to the sensor [m].
struct TileCentre {
  double x, y, z;
};

[[gnu::always_inline]] inline TileCentre centreOf(const BeamBlock& block, int number) {
  const int i = number % kTileEdge, j = number / kTileEdge % kTileEdge, k = number / (kTileEdge * kTileEdge);
  return {block.first[0] + (2 * i + 0.5) * block.resolution,
          block.first[1] + (2 * j + 0.5) * block.resolution,
          block.first[2] + (2 * k + 0.5) * block.resolution};
}

/// From a tile's centre to its voxel's centres, and the kernel's length beyond [m].
[[gnu::always_inline]] inline float radiusOf(const BeamBlock& block) {
  return (block.length + 0.8660255f * static_cast<float>(block.resolution)) * 1.0001f;
}

/// All tiles of a block: their directions, and the cells of the beams that come within reach.
struct TileWindows {
  float r[kTiles];                                    ///< distance from the sensor [m]
  std::int32_t cx[kTiles], cy[kTiles], cz[kTiles];    ///< unit directions [kDirectionStep]
  std::int32_t first_row[kTiles], last_row[kTiles];
  std::int32_t first_column[kTiles], last_column[kTiles];  ///< first > last: over the seam
};

[[gnu::always_inline]] inline Tile tileOf(const BeamBlock& block, const TileWindows& windows, int number) {
  const float inverse_length = 1.0f / block.length;
  Tile tile;
  tile.cx = windows.cx[number];
  tile.cy = windows.cy[number];
  tile.cz = windows.cz[number];
  tile.r = windows.r[number] * inverse_length;
  tile.half = 0.5f * static_cast<float>(block.resolution) * inverse_length;
  tile.radius = radiusOf(block) * inverse_length;
  tile.length = block.length;
  tile.first_voxel = 2 * (number % kTileEdge) + kBlockEdge * 2 * (number / kTileEdge % kTileEdge) +
                     kBlockEdge * kBlockEdge * 2 * (number / (kTileEdge * kTileEdge));
  return tile;
}

void findDirections(const BeamBlock& block, TileWindows& windows) {
  for (int number = 0; number < kTiles; ++number) {
    const TileCentre c = centreOf(block, number);
    const double r2 = c.x * c.x + c.y * c.y + c.z * c.z;
    const double r = std::sqrt(r2 > 1e-12 ? r2 : 1e-12), steps = 1.0 / (r * kDirectionStep);
    windows.r[number] = static_cast<float>(r);
    windows.cx[number] = static_cast<std::int32_t>(c.x * steps);
    windows.cy[number] = static_cast<std::int32_t>(c.y * steps);
    windows.cz[number] = static_cast<std::int32_t>(c.z * steps);
  }
}

/// The windows: a ball of radius l at distance r subtends delta = asin(l / r) in elevation theta, so that
/// sin(theta +- delta) = sin(theta) cos(delta) +- cos(theta) sin(delta), and asin(l / rho) in azimuth, with
/// rho its distance in the plane. A ball that covers a pole reaches up to it, over the whole circle.
void findWindows(const BeamBlock& block, TileWindows& windows) {
  findDirections(block, windows);
  const float l = radiusOf(block);
  for (int number = 0; number < kTiles; ++number) {
    const TileCentre centre = centreOf(block, number);
    const auto x = static_cast<float>(centre.x), y = static_cast<float>(centre.y),
               z = static_cast<float>(centre.z);
    const float rho2 = x * x + y * y, r2 = rho2 + z * z;
    const float inverse_r2 = 1.0f / (r2 > 1e-12f ? r2 : 1e-12f), s2 = l * l * inverse_r2;
    const float a = z * std::sqrt(inverse_r2 * (s2 < 1.0f ? 1.0f - s2 : 0.0f)),
                b = std::sqrt(rho2 * inverse_r2 * s2);
    const bool pole = !(rho2 > l * l), all = !(s2 < 1.0f);
    windows.first_row[number] = beamRow(all || (pole && z < 0.0f) ? -1.0f : a - b);
    windows.last_row[number] = beamRow(all || (pole && z > 0.0f) ? 1.0f : a + b);
    const float sine2 = pole ? 1.0f : l * l / rho2;
    const float s = std::sqrt(sine2), c = std::sqrt(1.0f - sine2);
    const int low = beamColumn(pseudoAngle(x * c + y * s, y * c - x * s)),
              high = beamColumn(pseudoAngle(x * c - y * s, y * c + x * s));
    windows.first_column[number] = pole ? 0 : low;
    windows.last_column[number] = pole ? kBeamColumns - 1 : high;
  }
}

}  // namespace
}  // namespace bki_mapping
