/// @file Evidence in fixed point, and the rounding to it. src/rules/apply_scan_rules.h rounds what the rules
/// of a scan leave of a sum, and src/update/sum_kernels_inl.h many sums at once, in the same way.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace bki_mapping {

/// Evidence in fixed point: whole numbers of kEvidenceUnit. A scan's sum for a voxel and a class is rounded
/// to the nearest unit once, and then added as an integer. Adding scans rounds nothing further, so that the
/// sum is the same to the bit in any order, and a scan can be withdrawn. docs/method.md gives the reasons for
/// the size of the unit.
using EvidenceUnits = std::int32_t;
constexpr float kEvidenceUnit = 0x1.0p-16f;
/// Evidence saturates here, at 32,768, instead of overflowing.
constexpr EvidenceUnits kMostUnits = std::numeric_limits<EvidenceUnits>::max();

/// Evidence as a number. Negative evidence counts as 0; it can only remain after a scan was withdrawn that
/// had never been added.
inline float evidenceOf(EvidenceUnits units) {
  return kEvidenceUnit * static_cast<float>(std::max(units, 0));
}

/// The nearest number of units. @param evidence within the range.
inline EvidenceUnits unitsOf(double evidence) {
  return static_cast<EvidenceUnits>(std::lround(evidence / static_cast<double>(kEvidenceUnit)));
}

}  // namespace bki_mapping
