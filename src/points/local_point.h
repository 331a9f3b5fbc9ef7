/// @file A point in the coordinates of one block.
#pragma once

#include <cstddef>
#include <cstdint>

namespace bki_mapping {

/// A labelled point: [voxels], from the centre of the block's first voxel.
struct LocalPoint {
  static constexpr std::uint16_t kOutside = 0xffff;

  float x, y, z;
  std::uint16_t label;
  std::uint16_t voxel;  ///< that holds it, or kOutside if that is in another block
};

/// Some of the points of a block.
struct PointRun {
  const LocalPoint* points;
  std::size_t count;
  std::uint64_t classes = 0;  ///< of the points, by classBit(); not set where all points of a scan are of one
  const float* weights = nullptr;  ///< of the points; null if all are 1

  /// The bit of a class; large ids share the last one.
  static constexpr std::uint32_t kSharedBit = 63;
  static std::uint64_t classBit(std::uint32_t label) {
    return std::uint64_t{1} << (label < kSharedBit ? label : kSharedBit);
  }
};

}  // namespace bki_mapping
