/// @file One labelled lidar scan.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace bki_mapping {

/// The hits of one sweep. Points are kept relative to the sensor so that single precision is enough
/// however far the map's origin is away.
struct Scan {
  /// Sensor origin in the map frame [m]; where the beams start.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  /// Hits relative to `origin`, in the axes of the map frame [m].
  std::vector<Eigen::Vector3f> points;
  /// The data set's own label number of each hit; as long as `points`.
  std::vector<std::uint32_t> labels;
  /// Time of the scan [ns]. Seeds the random free-space samples: scans drawn at the same time and with the
  /// same seed draw the same numbers, whatever their order.
  std::uint64_t stamp = 0;
};

}  // namespace bki_mapping
