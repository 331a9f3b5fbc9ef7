/// @file Voxels as a PCL cloud.
#pragma once

#include <pcl/PCLPointCloud2.h>

#include <cstddef>

namespace bki_mapping::ros_interface {

/// A cloud of `count` VoxelPoints, without their data. @throws std::length_error if a cloud cannot hold so
/// many.
pcl::PCLPointCloud2 pclHeader(std::size_t count);

}  // namespace bki_mapping::ros_interface
