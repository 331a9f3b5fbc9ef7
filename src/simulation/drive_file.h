/// @file What a simulated drive was made from, beside its scans.
#pragma once

#include <optional>
#include <string>

#include "simulation/lidar.h"

namespace bki_mapping::simulation {

/// Writes `simulation.yaml` into the folder of a drive. @throws std::runtime_error if that fails.
void writeDriveFile(const std::string& folder, const DriveConfig& config);

/// Reads it again, so that the street, the ground truth, can be built anew.
/// @return nothing if the folder has no such file. @throws std::runtime_error naming the file and what is
/// wrong.
std::optional<DriveConfig> readDriveFile(const std::string& folder);

}  // namespace bki_mapping::simulation
