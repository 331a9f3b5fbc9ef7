#include "bki_mapping/query/nearest_obstacle.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

namespace bki_mapping {
namespace {

/// Squared distance from a point to a cube of voxels [voxels].
double squaredDistance(const Eigen::Vector3d& point, const GridIndex& cube, double edge) {
  const Eigen::Vector3d low = Eigen::Vector3d(cube.x, cube.y, cube.z) * edge;
  const Eigen::Array3d beyond = (low - point).array().max((point - low).array() - edge).max(0.0);
  return beyond.square().sum();
}

class Search {
 public:
  /// @param point, most [voxels].
  Search(const StateMap& states, const Eigen::Vector3d& point, const ClassSet& classes, double most)
      : states_(states), reader_(states), point_(point), classes_(classes), nearest_(most * most) {}

  /// Looks at the blocks around the point, in rings of blocks, nearest first; then at what may be nearer
  /// than the nearest found, region by region.
  void run() {
    const BlockIndex centre = {{cubeOf(0), cubeOf(1), cubeOf(2)}};
    constexpr int kRings = 3;
    for (int ring = 0; ring <= kRings; ++ring) lookAtRing(centre, ring);
    constexpr double kLookedAt = kRings * kBlockEdge;  // all around, at least
    if (nearest_ <= kLookedAt * kLookedAt) return;
    std::vector<std::pair<double, GridIndex>> regions;
    for (const GridIndex& region : states_.map().regions()) {
      const double distance = squaredDistance(point_, region, kBlockEdge * Region::kEdge);
      if (distance <= nearest_) regions.emplace_back(distance, region);
    }
    std::sort(regions.begin(), regions.end());
    for (const auto& [distance, region] : regions) {
      if (distance > nearest_) break;
      for (int number = 0; number < Region::kBlocks; ++number) {
        lookAtBlock({GridGeometry::voxelOf({region}, number)});
      }
    }
  }

  bool found() const { return found_; }
  const VoxelIndex& voxel() const { return voxel_; }
  ClassId label() const { return label_; }
  double distance() const { return std::sqrt(nearest_); }  ///< [voxels]

 private:
  std::int32_t cubeOf(Eigen::Index axis) const {
    return static_cast<std::int32_t>(std::floor(point_[axis] / kBlockEdge));
  }

  void lookAtRing(const BlockIndex& centre, int ring) {
    for (int z = -ring; z <= ring; ++z) {
      for (int y = -ring; y <= ring; ++y) {
        const bool whole = std::abs(z) == ring || std::abs(y) == ring;
        for (int x = -ring; x <= ring; x += whole || ring == 0 ? 1 : 2 * ring) {
          lookAtBlock({{centre.x + x, centre.y + y, centre.z + z}});
        }
      }
    }
  }

  void lookAtBlock(const BlockIndex& index) {
    if (squaredDistance(point_, index, kBlockEdge) > nearest_) return;
    const BlockStates* const block = reader_.find(index);
    if (!block || !block->any_occupied) return;
    for (std::size_t z = 0; z < kBlockEdge; ++z) {
      for (std::uint64_t bits = block->layers[z].occupied; bits != 0; bits &= bits - 1) {
        const std::size_t offset = 64 * z + static_cast<std::size_t>(__builtin_ctzll(bits));
        const VoxelIndex voxel = GridGeometry::voxelOf(index, static_cast<int>(offset));
        const double distance =
            (Eigen::Vector3d(voxel.x + 0.5, voxel.y + 0.5, voxel.z + 0.5) - point_).squaredNorm();
        if (distance > nearest_ || (found_ && distance == nearest_ && !(voxel < voxel_))) continue;
        if (!classes_.contains(block->labels[offset])) continue;
        found_ = true;
        nearest_ = distance;
        voxel_ = voxel;
        label_ = block->labels[offset];
      }
    }
  }

  const StateMap& states_;
  BlockReader reader_;
  Eigen::Vector3d point_;
  ClassSet classes_;
  double nearest_;  ///< squared distance of the nearest so far [voxels^2]
  bool found_ = false;
  VoxelIndex voxel_;
  ClassId label_ = kFreeClass;
};

}  // namespace

std::optional<NearestObstacle> nearestObstacle(const StateMap& states, const Eigen::Vector3d& point,
                                               const ClassSet& classes, double max_distance) {
  if (!states.geometry().contains(point)) {
    throw std::invalid_argument(
        "the point is not finite or lies beyond the map's grid; give one within the map");
  }
  if (!(max_distance >= 0.0)) {
    throw std::invalid_argument("the greatest distance is negative or not a number; give metres, 0 or more");
  }
  const double resolution = states.geometry().resolution();
  Search search(states, point / resolution, classes, max_distance / resolution);
  search.run();
  if (!search.found()) return std::nullopt;
  return NearestObstacle{search.voxel(), search.label(), search.distance() * resolution};
}

}  // namespace bki_mapping
