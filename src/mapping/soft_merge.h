/// @file Merges the soft labels of down-sampled hits.
#pragma once

#include <vector>

#include "bki_mapping/core/scan.h"
#include "points/downsample.h"
#include "points/merged_points.h"

namespace bki_mapping {

/// A point of a scan that became a hit.
struct UsedPoint {
  std::uint32_t offset;  ///< in Scan::points
  ClassId id;            ///< of its class
};

/// Merges shares cell by cell: a down-sampled hit gets the mean over those points of its cell that have its
/// class as their likeliest. So shares of 0 and 1 give the same map as hard labels.
/// @param used points that became hits, by chunk, in the order of the scan.
/// @param cell edge of the down-sampling cells [m]; 0: off. @param hits after down-sampling.
/// @return each hit once for each of its classes, weighted by the share; empty if each hit has a single
/// class.
std::vector<MergedPoints> mergeSoftLabels(const ScanView& scan,
                                          const std::vector<std::vector<UsedPoint>>& used, double cell,
                                          const LabelledPoints& hits);

}  // namespace bki_mapping
