#include "ros/voxel_pcl.h"

#include <limits>
#include <stdexcept>

#include "export/voxel_points.h"

namespace bki_mapping::ros_interface {

pcl::PCLPointCloud2 pclHeader(std::size_t count) {
  if (count > std::numeric_limits<std::uint32_t>::max() / sizeof(VoxelPoint)) {
    throw std::length_error(std::to_string(count) + " voxels are more than a point cloud can hold");
  }
  pcl::PCLPointCloud2 cloud;
  for (const VoxelField& field : kVoxelFields) {
    cloud.fields.emplace_back();
    cloud.fields.back().name = field.name;
    cloud.fields.back().offset = field.offset;
    cloud.fields.back().datatype = field.type;
    cloud.fields.back().count = 1;
  }
  cloud.point_step = sizeof(VoxelPoint);
  cloud.height = 1;
  cloud.width = static_cast<std::uint32_t>(count);
  cloud.row_step = cloud.point_step * cloud.width;
  cloud.is_dense = true;
  return cloud;
}

}  // namespace bki_mapping::ros_interface
