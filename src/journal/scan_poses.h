/// @file Where scans of a journal belong by a file of poses.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "bki_mapping/store/scan_record.h"
#include "journal/corrected_path.h"
#include "sequence/trajectory_file.h"

namespace bki_mapping {

/// The poses where the scans of a drive belong. Poses without stamps belong to the scans in order; those with
/// stamps are keyframes of a CorrectedPath. Stamps are of the scans' clock; that of a sequence, whose scans
/// have no name of a sensor, begins at Sequence::kFirstStamp.
/// @param scans of the drive, not empty. @param path of the poses, for errors.
/// @throws std::invalid_argument in one sentence: other numbers of poses and scans, no pose among the scans,
/// poses with stamps for scans of several sensors.
std::vector<Eigen::Isometry3d> wantedPoses(const std::vector<ScanRecord>& scans, const LidarPoses& poses,
                                           const std::string& path);
/// The same by poses with stamps. @param keyframes their stamps are those of the scans, within 1 ms.
/// @param name of the poses, for errors. @param zero from which errors count seconds [ns].
std::vector<Eigen::Isometry3d> wantedPoses(const std::vector<ScanRecord>& scans,
                                           std::vector<StampedMotion> keyframes, const std::string& name,
                                           std::uint64_t zero = 0);

}  // namespace bki_mapping
