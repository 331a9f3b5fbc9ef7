/// @file The filter against which times are measured, so that those of different machines can be compared.
#pragma once

#include "bki_mapping/sequence/sequence.h"
#include "evaluation/scan_timer.h"

namespace bki_mapping::tools {

/// Time of pcl::VoxelGrid with leaves of 0.1 m on a raw, labelled scan, on one thread.
ScanTime yardstick(const SequenceFrame& frame);

}  // namespace bki_mapping::tools
