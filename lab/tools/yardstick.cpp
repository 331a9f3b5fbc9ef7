#include "tools/yardstick.h"

#include <pcl/filters/voxel_grid.h>
#include <pcl/point_types.h>

namespace bki_mapping::tools {

ScanTime yardstick(const SequenceFrame& frame) {
  const auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZL>>();
  for (std::size_t p = 0; p < frame.points.size(); ++p) {
    pcl::PointXYZL point;
    point.getVector3fMap() = frame.points[p];
    point.label = frame.labels.empty() ? 0 : frame.labels[p];
    cloud->push_back(point);
  }
  pcl::VoxelGrid<pcl::PointXYZL> grid;
  pcl::PointCloud<pcl::PointXYZL> output;
  ScanTimer timer;
  grid.setInputCloud(cloud);
  grid.setLeafSize(0.1f, 0.1f, 0.1f);
  grid.filter(output);
  return timer.elapsed();
}

}  // namespace bki_mapping::tools
