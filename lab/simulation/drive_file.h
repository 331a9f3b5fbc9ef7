/// @file Stores the settings of a simulated drive next to its scans.
#pragma once

#include <optional>
#include <string>

#include "simulation/lidar.h"

namespace bki_mapping::simulation {

/// Writes `simulation.yaml` into the folder of a drive, and `trajectory.txt` if it is along a trajectory:
/// the poses of the lidar. @throws std::runtime_error if that fails.
void writeDriveFile(const std::string& folder, const DriveConfig& config);

/// Reads these files, from which Drive rebuilds the scene: the ground truth of the scans.
/// @return nullopt if the folder has no `simulation.yaml`. @throws std::runtime_error naming the file and
/// what is wrong.
std::optional<DriveConfig> readDriveFile(const std::string& folder);

}  // namespace bki_mapping::simulation
