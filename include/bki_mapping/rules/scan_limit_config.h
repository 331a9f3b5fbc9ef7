/// @file The limit of the size of a scan.
#pragma once

#include <cstdint>

namespace bki_mapping {

struct ScanLimitConfig {
  /// Largest number of blocks that the hits of a scan, or its free space, may touch; 0: the number within the
  /// sensor's reach, at most kMostBlocks. A larger scan is refused.
  std::int64_t blocks = 0;

  static constexpr std::int64_t kMostBlocks = 1 << 18;  ///< 0.5 GB for each class that they all hold
};

}  // namespace bki_mapping
