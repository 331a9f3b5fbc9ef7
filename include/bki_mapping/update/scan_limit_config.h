/// @file Settings of what one scan may add to the map.
#pragma once

#include <cstdint>

namespace bki_mapping {

/// Most evidence that one scan adds to a voxel; 0: no limit.
struct ScanLimitConfig {
  double hits = 0.0;  ///< of all classes together; larger sums are scaled down
  double free = 0.0;
  /// Most blocks that its hits, or its free space, may touch; 0: those within the sensor's reach, at most
  /// kMostBlocks. A larger scan is refused whole.
  std::int64_t blocks = 0;

  static constexpr std::int64_t kMostBlocks = 1 << 18;  ///< 0.5 GB for each class that all of them hold
};

}  // namespace bki_mapping
