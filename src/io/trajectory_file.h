/// @file Trajectories from files.
#pragma once

#include <string>

#include "io/html_export.h"

namespace bki_mapping {

/// Reads where the sensor was, in the map frame: the poses of a sequence, if `path` is a folder; otherwise
/// those of a file in one of the formats of readPoseFile().
/// @throws std::runtime_error in one sentence: no such file, a line that is not such a pose, no pose at all,
/// or as Sequence.
Trajectory readTrajectory(const std::string& path);

}  // namespace bki_mapping
