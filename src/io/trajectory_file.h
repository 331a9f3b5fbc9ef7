/// @file Trajectories from files.
#pragma once

#include <string>

#include "io/html_export.h"

namespace bki_mapping {

/// Reads where the sensor was, in the map frame: the poses of a sequence, if `path` is a folder; otherwise a
/// text file in the format of the TUM RGB-D benchmark, with `stamp x y z qx qy qz qw` on each line, of which
/// the rotation may be missing. Lines that begin with # are comments.
/// @throws std::invalid_argument in one sentence: no such file, a line that is not such a pose, no pose at
/// all; std::runtime_error as Sequence.
Trajectory readTrajectory(const std::string& path);

}  // namespace bki_mapping
