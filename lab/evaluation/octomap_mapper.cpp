#include "evaluation/octomap_mapper.h"

#include <octomap/OcTree.h>

#include "core/stopwatch.h"

namespace bki_mapping {

struct OctomapMapper::Tree {
  explicit Tree(double resolution) : octree(resolution) {}
  octomap::OcTree octree;
};

OctomapMapper::OctomapMapper(double resolution) : tree_(std::make_unique<Tree>(resolution)) {}

OctomapMapper::~OctomapMapper() = default;

double OctomapMapper::integrate(const Scan& scan) {
  octomap::Pointcloud cloud;
  cloud.reserve(scan.points.size());
  for (const Eigen::Vector3f& point : scan.points) {
    if (!point.allFinite()) continue;
    const Eigen::Vector3f at = (scan.origin + point.cast<double>()).cast<float>();
    cloud.push_back(at.x(), at.y(), at.z());
  }
  const Eigen::Vector3f origin = scan.origin.cast<float>();
  Stopwatch watch;
  tree_->octree.insertPointCloud(cloud, octomap::point3d(origin.x(), origin.y(), origin.z()));
  return watch.lap();
}

std::optional<ClassId> OctomapMapper::at(const VoxelIndex& voxel) {
  constexpr int kKeyOfZero = 1 << 15;
  const auto key = [](int coordinate) { return static_cast<octomap::key_type>(coordinate + kKeyOfZero); };
  const octomap::OcTreeNode* const node =
      tree_->octree.search(octomap::OcTreeKey(key(voxel.x), key(voxel.y), key(voxel.z)));
  if (!node || !tree_->octree.isNodeOccupied(node)) return std::nullopt;
  return kFreeClass;
}

std::size_t OctomapMapper::bytes() const {
  return tree_->octree.memoryUsage();
}

}  // namespace bki_mapping
