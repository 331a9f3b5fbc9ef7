/// @file The innermost loop of line evidence; each instruction set's file includes it and gets a copy of its
/// own. A block is cut into eight octants of 4 x 4 x 4 voxels, and these into tiles of 2 x 2 x 2. The beams
/// near an octant are picked from a few slices of the table, of these the beams near each of its tiles, and
/// these are added to the tile's eight voxels, several beams side by side.
#pragma once

#include <cmath>

#include "beam_tile.h"
#include "beam_window.h"
#include "bki_mapping/core/config.h"
#include "bki_mapping/inference/beam_cells.h"
#include "lanes.h"
#include "picked_beams.h"
#include "voxel_loop.h"

namespace bki_mapping {
namespace {

using OctantBeams = PickedBeams<TiledBeams::kMostOfTile>;

/// Adds the beams picked for an octant to its tiles, and forgets them.
template <BeamWeight kWeight>
void addOctant(const BeamBlock& block, const Places& places, int octant, OctantBeams& near_octant,
               float* sums) {
  TiledBeams near_tiles;
  near_octant.pad();
  for (int n = 0; n < kOctantTiles; ++n) {
    const Place place = places.tile(octant, n);
    const int first = near_tiles.beams.count;
    for (int b = 0; b < near_octant.count; b += kLanes) {
      pick(BeamsAt(near_octant, b), near_octant.count - b, place, near_tiles.beams);
    }
    near_tiles.finish(first, n);
  }
  if (near_tiles.beams.count > 0) {
    near_tiles.finishAll();
    addTiles<kWeight>(near_tiles, Tiles(block, places, octant), octant, sums);
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
  OctantBeams near_octant;
  for (int octant = 0; octant < 8; ++octant) {
    if (addAlone(octant)) continue;
    const Place place = places.octant(octant);
    forEachRangeOf(octant, [&](BeamRange range) {
      for (std::uint32_t b = range.first; b < range.last; b += kLanes) {
        pick(BeamsAt(beams, b), static_cast<std::int32_t>(range.last - b), place, near_octant);
        if (near_octant.count > OctantBeams::kMost - kLanes) {
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
