/// @file A point in the coordinates of one block.
#pragma once

#include <cstdint>

namespace bki_mapping {

/// A labelled point: [voxels], from the centre of the block's first voxel.
struct LocalPoint {
  float x, y, z;
  std::uint32_t label;
};

}  // namespace bki_mapping
