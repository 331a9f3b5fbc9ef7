/// @file The way of a cloud into a map: the same for the node and for recordings.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <functional>
#include <optional>
#include <string>

#include "bki_mapping/core/grid_geometry.h"
#include "ros/pose_source.h"
#include "ros/scan_ledger.h"
#include "ros/scan_reader.h"

namespace bki_mapping::ros_interface {

/// Why a cloud is not in the map: the reason to be counted, and a sentence with the remedy.
struct Refusal {
  DropReason reason;
  std::string why;
};

/// Ends of sentences that depend on where clouds come from.
struct Remedies {
  std::string missing_pose;  ///< of a cloud whose pose tf lacks
  std::string memory;        ///< of a cloud for which memory_limit leaves no room
};

/// Makes a scan of a cloud and has it added to the map.
/// @param now the time on this computer, for explanations; 0: not known.
/// @param geometry of the map, which must reach as far as the sensor.
/// @param integrate adds the scan; what it throws becomes a refusal.
/// @return nullopt if integrate() returned.
std::optional<Refusal> mapCloud(const sensor_msgs::PointCloud2& cloud, const ScanReader& reader,
                                const PoseSource& poses, const ros::Time& now, const GridGeometry& geometry,
                                const Remedies& remedies,
                                const std::function<void(const PlacedScan&)>& integrate);

}  // namespace bki_mapping::ros_interface
