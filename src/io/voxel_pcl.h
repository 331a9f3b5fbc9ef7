/// @file Voxels as a PCL cloud: the fields of PCD files and of the topic voxel_cloud.
#pragma once

#include <pcl/PCLPointCloud2.h>

#include <vector>

#include "bki_mapping/io/map_export.h"

namespace bki_mapping {

/// Fields x y z rgb (float32; rgb packed as PCL does), label (uint16), state (uint8), probability occupancy
/// class_probability variance entropy evidence (float32).
pcl::PCLPointCloud2 toPcl(const std::vector<VoxelRecord>& voxels);

}  // namespace bki_mapping
