/// @file Counts and times of one scan.
#pragma once

#include <cstddef>

namespace bki_mapping {

/// What happened to the points of a scan, as mapping/scan_preprocessor.cpp counts them; `points` is the sum
/// of the counts that follow, except the last.
struct PointCounts {
  std::size_t points = 0;
  std::size_t used = 0;           ///< became hits
  std::size_t not_finite = 0;     ///< a coordinate is not finite, or a share is not a probability
  std::size_t at_sensor = 0;      ///< within 1 mm of the sensor
  std::size_t too_near = 0;       ///< closer than sensor_model/min_range
  std::size_t beyond_max = 0;     ///< farther than SensorModelConfig::reach()
  std::size_t outside_map = 0;    ///< too far from the map's origin for an index
  std::size_t unknown_label = 0;  ///< not in the class table, with unknown_labels `ignore`
  std::size_t unlabelled = 0;     ///< of the unlabelled class, with unlabelled_points `ignore`
  std::size_t airborne = 0;       ///< of a class with the flag airborne: their beams clear up to them
  std::size_t isolated = 0;       ///< drops, flakes, fog or dust by rules/particles_within: likewise
  std::size_t no_direction = 0;   ///< beams without a return whose direction is not known
  std::size_t no_returns = 0;     ///< beams without a return, which clear up to the sensor's range
  /// Points whose label is not in the class table; they are also counted above.
  std::size_t labels_not_in_table = 0;

  PointCounts& operator+=(const PointCounts& other);
};

/// What one scan added, and how long each phase took.
struct ScanStats {
  PointCounts counts;
  std::size_t hits = 0;        ///< after down-sampling
  double half_range = 0.0;     ///< range within which half of the used points are [m]; 0 if there are none
  std::size_t free_count = 0;  ///< free samples after down-sampling, or beams
  std::size_t blocks = 0;      ///< blocks touched
  std::size_t not_finite = 0;  ///< sums left out because they were not finite
  std::size_t saturated = 0;   ///< number of voxels and classes whose evidence saturated
  std::size_t negative = 0;    ///< number of voxels and classes that withdraw() left with negative evidence
  double observe_ms = 0.0;     ///< filtering, down-sampling
  double evidence_ms = 0.0;    ///< sampling, sorting, indexing
  double collect_ms = 0.0;     ///< listing and allocating blocks
  double update_ms = 0.0;      ///< adding to the blocks
  double totalMs() const { return observe_ms + evidence_ms + collect_ms + update_ms; }
};

}  // namespace bki_mapping
