/// @file Soft labels of down-sampled hits.
#pragma once

#include <vector>

#include "bki_mapping/core/scan.h"
#include "points/downsample.h"

namespace bki_mapping {

/// A point of a scan that became a hit.
struct UsedPoint {
  std::uint32_t place;  ///< in the scan
  ClassId id;           ///< its class
};

/// The shares of each down-sampled hit: the mean over the points of its cell that have its class as their
/// likeliest. So labels that are sure give what labels without shares give.
/// @param used the points that became hits, chunk by chunk, in the order of the scan.
/// @param cell edge of the cells [m]; 0: each point has its own. @param hits what the down-sampler made.
/// @param[out] soft the shares; empty if each hit is of one class alone.
void mergeSoftLabels(const Scan& scan, const std::vector<std::vector<UsedPoint>>& used, double cell,
                     const LabelledPoints& hits, SoftLabels& soft);

}  // namespace bki_mapping
