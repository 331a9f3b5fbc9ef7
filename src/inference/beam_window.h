/// @file The octants and tiles of a block as seen from the sensor, and the cells of the beams near each
/// octant; included by beam_loop.h alone.
#pragma once

#include <cmath>

#include "bki_mapping/core/types.h"
#include "bki_mapping/inference/beam_block.h"
#include "bki_mapping/inference/beam_cells.h"

namespace bki_mapping {
namespace {

/// Octants of 4 x 4 x 4 voxels and tiles of 2 x 2 x 2 voxels: a side, and in all.
constexpr int kOctantEdge = 2, kOctants = 8;
constexpr int kTileEdge = 4, kTiles = 64, kOctantTiles = 8;
static_assert(kBlockEdge == 8);

/// A ball of voxels, and which beams reach it.
struct Place {
  std::int32_t cx, cy, cz;  ///< unit direction of its centre from the sensor [kDirectionStep]
  float chord2;   ///< between that and the directions that pass it, squared, less than [kDirectionStep^2]
  float nearest;  ///< its distance from the sensor [m]; negative where it holds the sensor
};

/// All octants and tiles of a block, and how they are numbered: octant by octant.
struct Places {
  std::int32_t cx[kOctants + kTiles], cy[kOctants + kTiles], cz[kOctants + kTiles];
  float chord2[kOctants + kTiles], nearest[kOctants + kTiles];
  float r[kOctants + kTiles];  ///< distances of their centres from the sensor [m]

  Place octant(int n) const { return {cx[n], cy[n], cz[n], chord2[n], nearest[n]}; }
  /// Of an octant.
  Place tile(int octant_number, int n) const { return octant(firstTile(octant_number) + n); }
  static int firstTile(int octant) { return kOctants + kOctantTiles * octant; }
};

/// The centre of one of edge^3 cubes into which a block is cut, relative to the sensor [m].
struct Centre {
  double x, y, z;
};

template <int kEdge>
[[gnu::always_inline]] inline Centre centreOf(const BeamBlock& block, int n) {
  constexpr double kWidth = kBlockEdge / kEdge, kFirst = 0.5 * (kWidth - 1.0);
  const int i = n % kEdge, j = n / kEdge % kEdge, k = n / (kEdge * kEdge);
  return {block.first[0] + (kWidth * i + kFirst) * block.resolution,
          block.first[1] + (kWidth * j + kFirst) * block.resolution,
          block.first[2] + (kWidth * k + kFirst) * block.resolution};
}

/// From such a cube's centre to the centres of its voxels, and the kernel's length beyond [m].
template <int kEdge>
[[gnu::always_inline]] inline float radiusOf(const BeamBlock& block) {
  constexpr float kToVoxel = 0.8660255f * (kBlockEdge / kEdge - 1);
  return (block.length + kToVoxel * static_cast<float>(block.resolution)) * 1.0001f;
}

/// The place in its block of an octant's n-th tile, and of the tile's first voxel.
[[gnu::always_inline]] inline int tileInBlock(int octant, int n) {
  const int i = 2 * (octant & 1) + (n & 1), j = 2 * (octant >> 1 & 1) + (n >> 1 & 1),
            k = 2 * (octant >> 2) + (n >> 2);
  return i + kTileEdge * (j + kTileEdge * k);
}
[[gnu::always_inline]] inline int firstVoxel(int octant, int n) {
  const int i = 4 * (octant & 1) + 2 * (n & 1), j = 4 * (octant >> 1 & 1) + 2 * (n >> 1 & 1),
            k = 4 * (octant >> 2) + 2 * (n >> 2);
  return i + kBlockEdge * (j + kBlockEdge * k);
}

template <int kEdge>
[[gnu::always_inline]] inline void findPlacesOf(const BeamBlock& block, int first, Places& places) {
  const float radius = radiusOf<kEdge>(block);
  for (int n = 0; n < kEdge * kEdge * kEdge; ++n) {
    const Centre c =
        centreOf<kEdge>(block, kEdge == kTileEdge ? tileInBlock(n / kOctantTiles, n % kOctantTiles) : n);
    const double r2 = c.x * c.x + c.y * c.y + c.z * c.z;
    const double r = std::sqrt(r2 > 1e-12 ? r2 : 1e-12), steps = 1.0 / (r * kDirectionStep);
    const auto rf = static_cast<float>(r);
    places.r[first + n] = rf;
    places.cx[first + n] = static_cast<std::int32_t>(c.x * steps);
    places.cy[first + n] = static_cast<std::int32_t>(c.y * steps);
    places.cz[first + n] = static_cast<std::int32_t>(c.z * steps);
    // The chord of asin(s) is sqrt(2 - 2 sqrt(1 - s^2)).
    const float s2 = radius * radius / (rf * rf), c2 = s2 < 1.0f ? 1.0f - s2 : 0.0f;
    const float chord2 = 2.0f * s2 / (1.0f + std::sqrt(c2));
    places.chord2[first + n] = (s2 < 1.0f ? chord2 : 4.0f) * 1.0001f / (kDirectionStep * kDirectionStep);
    places.nearest[first + n] = rf - radius;
  }
}

void findPlaces(const BeamBlock& block, Places& places) {
  findPlacesOf<kOctantEdge>(block, 0, places);
  findPlacesOf<kTileEdge>(block, kOctants, places);
}

/// The cells of the beams that come within reach of each of kCount balls.
template <int kCount>
struct Windows {
  std::int32_t first_row[kCount], last_row[kCount];
  std::int32_t first_column[kCount], last_column[kCount];  ///< first > last: over the seam
};

/// The window of a ball of radius l about (x, y, z): at distance r it subtends delta = asin(l / r) in
/// elevation theta, so that sin(theta +- delta) = sin(theta) cos(delta) +- cos(theta) sin(delta), and asin(l
/// / rho) in azimuth, with rho its distance in the plane. A ball that covers a pole reaches up to it, over
/// the whole circle.
template <int kCount>
[[gnu::always_inline]] inline void findWindow(float x, float y, float z, float l, int n,
                                              Windows<kCount>& windows) {
  const float rho2 = x * x + y * y, r2 = rho2 + z * z;
  const float inverse_r2 = 1.0f / (r2 > 1e-12f ? r2 : 1e-12f), s2 = l * l * inverse_r2;
  const float a = z * std::sqrt(inverse_r2 * (s2 < 1.0f ? 1.0f - s2 : 0.0f)),
              b = std::sqrt(rho2 * inverse_r2 * s2);
  const bool pole = !(rho2 > l * l), all = !(s2 < 1.0f);
  windows.first_row[n] = beamRow(all || (pole && z < 0.0f) ? -1.0f : a - b);
  windows.last_row[n] = beamRow(all || (pole && z > 0.0f) ? 1.0f : a + b);
  const float sine2 = pole ? 1.0f : l * l / rho2;
  const float s = std::sqrt(sine2), c = std::sqrt(1.0f - sine2);
  const int low = beamColumn(pseudoAngle(x * c + y * s, y * c - x * s)),
            high = beamColumn(pseudoAngle(x * c - y * s, y * c + x * s));
  windows.first_column[n] = pole ? 0 : low;
  windows.last_column[n] = pole ? kBeamColumns - 1 : high;
}

/// Of the octants of a block.
void findWindows(const BeamBlock& block, Windows<kOctants>& windows) {
  const float l = radiusOf<kOctantEdge>(block);
  for (int n = 0; n < kOctants; ++n) {
    const Centre centre = centreOf<kOctantEdge>(block, n);
    findWindow(static_cast<float>(centre.x), static_cast<float>(centre.y), static_cast<float>(centre.z), l, n,
               windows);
  }
}

/// Calls visit(range) for the beams in the n-th window, row by row.
template <int kCount, typename Visit>
[[gnu::always_inline]] inline void forEachRange(const std::uint32_t* beams_begin,
                                                const Windows<kCount>& windows, int n, Visit&& visit) {
  const int first = windows.first_column[n], last = windows.last_column[n];
  for (int row = windows.first_row[n]; row <= windows.last_row[n]; ++row) {
    const std::uint32_t* const begin = beams_begin + row * kBeamColumns;
    if (first <= last) {
      visit(BeamRange{begin[first], begin[last + 1]});
    } else {  // over the seam
      visit(BeamRange{begin[first], begin[kBeamColumns]});
      visit(BeamRange{begin[0], begin[last + 1]});
    }
  }
}

}  // namespace
}  // namespace bki_mapping
