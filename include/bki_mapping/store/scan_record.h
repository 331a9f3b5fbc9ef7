/// @file A scan in the journal of a map file.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// A scan that is in the map, and can be moved to another pose. Its points are packed in
/// MapFile::scanContent.
struct ScanRecord {
  std::uint64_t number = 0;  ///< rises in the order in which the scans of a drive were integrated; below 2^63
  std::string drive;         ///< DriveRecord::id
  std::uint64_t stamp = 0;   ///< [ns], below 2^63
  std::string sensor;        ///< name of the sensor's frame; "" if only one sensor is known
  int settings = 0;          ///< number of the settings with which it was integrated (MapFile::settings)
  int cleared = 0;           ///< number of boxes that had been cleared before (MapFile::clearedBoxes)
  bool jump = false;         ///< between the scan before and this one, the recorded poses jump
  std::uint64_t bytes = 0;   ///< of its packed points; set when it is read
  double reach = 0.0;        ///< of its farthest hit [m]
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();  ///< where it is in the map
  /// Where it was recorded, in a frame that does not jump.
  Eigen::Isometry3d T_odometry_sensor = Eigen::Isometry3d::Identity();
  std::vector<GridIndex> tiles;  ///< that it touches at T_map_sensor, sorted, each once
};

/// What a file's journal holds.
struct JournalSize {
  std::uint64_t next_number = 0;  ///< above the numbers of all scans
  int settings = 0, cleared = 0;  ///< numbers of settings, and of cleared boxes
};

/// What changes in a journal, together with the map.
struct JournalChange {
  struct Added {
    ScanRecord scan;
    std::function<std::string()> content;  ///< packs its points; called in another thread
  };
  std::vector<std::string> settings;  ///< to be added, as YAML
  std::vector<Added> added;
  std::vector<ScanRecord> moved;  ///< scans that are in the journal or in `added`
};

}  // namespace bki_mapping
