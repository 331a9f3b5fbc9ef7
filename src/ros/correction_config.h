/// @file Settings of the journal of scans, and of corrected poses.
#pragma once

#include <string>
#include <vector>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping::ros_interface {

struct CorrectionConfig {
  bool journal = false;            ///< whether scans are kept, so that they can move
  double journal_quantum = 0.01;   ///< to which points are rounded in the sensor's frame [m]
  double journal_limit = 4000.0;   ///< of the memory of kept scans [MB]; 0: none
  double tolerance = -1.0;         ///< by which points may be off [m]; < 0: a tenth of the resolution
  std::string corrected_frame_id;  ///< whose poses corrected_path has; "": the sensor's
  std::string odometry_frame_id;   ///< in which poses do not jump; "": not known
};

/// The rows of the parameters, which have no common prefix.
std::vector<NamedParameter<CorrectionConfig>> correctionParameters();

}  // namespace bki_mapping::ros_interface
