/// @file Settings of what one scan may add to the map.
#pragma once

#include <cstdint>

namespace bki_mapping {

/// What one scan may add at most to one voxel; 0: no limit.
struct ScanLimitConfig {
  double hits = 0.0;  ///< to all classes together; they share it in proportion
  double free = 0.0;
  /// Blocks that its hits, or its free space, may touch; 0: as many as lie within the sensor's reach, but no
  /// more than kMostBlocks. A scan beyond the limit is refused whole.
  std::int64_t blocks = 0;

  static constexpr std::int64_t kMostBlocks = 1 << 18;  ///< half a gigabyte for each class in all of them
};

}  // namespace bki_mapping
