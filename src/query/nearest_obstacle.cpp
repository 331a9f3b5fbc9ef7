#include "bki_mapping/query/queries.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace bki_mapping {
namespace {

constexpr std::size_t kSearchesPerJob = 32;  ///< some 500 us

/// Squared distance from a point to a cube of voxels [voxels].
double squaredDistance(const Eigen::Vector3d& point, const GridIndex& cube, double edge) {
  const Eigen::Vector3d low = Eigen::Vector3d(cube.x, cube.y, cube.z) * edge;
  const Eigen::Array3d beyond = (low - point).array().max((point - low).array() - edge).max(0.0);
  return beyond.square().sum();
}

class Search {
 public:
  /// @param point, most [voxels].
  Search(const StateMap& states, const Eigen::Vector3d& point, const ClassFilter& classes, double most)
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
    if (!block || !block->any_occupied || !mayHold(*block->block)) return;
    const VoxelIndex first = GridGeometry::voxelOf(index, 0);
    const auto squared = [](double x) { return x * x; };
    for (std::int32_t z = 0; z < kBlockEdge; ++z) {
      const double along_z = squared(first.z + z + 0.5 - point_.z());
      const std::uint64_t occupied = block->layers[static_cast<std::size_t>(z)].occupied;
      if (occupied == 0 || along_z > nearest_) continue;
      for (std::int32_t y = 0; y < kBlockEdge; ++y) {
        const double across_x = along_z + squared(first.y + y + 0.5 - point_.y());
        if (across_x > nearest_) continue;
        for (std::uint64_t row = occupied >> kBlockEdge * y & 0xff; row != 0; row &= row - 1) {
          const std::int32_t x = first.x + __builtin_ctzll(row);
          consider({{x, first.y + y, first.z + z}}, across_x + squared(x + 0.5 - point_.x()), *block);
        }
      }
    }
  }

  /// Whether a voxel of the block may be of one of the classes: of others it has no evidence.
  bool mayHold(const Block& block) const {
    return std::any_of(block.classes().begin(), block.classes().end(),
                       [&](ClassId id) { return classes_.contains(id); });
  }

  void consider(const VoxelIndex& voxel, double distance, const BlockStates& block) {
    if (distance > nearest_ || (found_ && distance == nearest_ && !(voxel < voxel_))) return;
    const ClassId label = block.labels[static_cast<std::size_t>(GridGeometry::offsetInBlock(voxel))];
    if (!classes_.contains(label)) return;
    found_ = true;
    nearest_ = distance;
    voxel_ = voxel;
    label_ = label;
  }

  const StateMap& states_;
  BlockReader reader_;
  Eigen::Vector3d point_;
  ClassFilter classes_;
  double nearest_;  ///< squared distance of the nearest so far [voxels^2]
  bool found_ = false;
  VoxelIndex voxel_;
  ClassId label_ = kFreeClass;
};

/// @param name called as name() for what the message calls the point.
template <typename Name>
void checkPoint(const GridGeometry& geometry, const Eigen::Vector3d& point, Name&& name) {
  if (geometry.contains(point)) return;
  throw std::invalid_argument(name() +
                              " is not finite or lies beyond the map's grid; give one within the map");
}

void checkDistance(double max_distance) {
  if (max_distance >= 0.0) return;
  throw std::invalid_argument("the greatest distance is negative or not a number; give metres, 0 or more");
}

std::optional<NearestObstacle> search(const StateMap& states, const Eigen::Vector3d& point,
                                      const ClassFilter& classes, double max_distance) {
  const double resolution = states.geometry().resolution();
  Search search(states, point / resolution, classes, max_distance / resolution);
  search.run();
  if (!search.found()) return std::nullopt;
  return NearestObstacle{search.voxel(), search.label(), search.distance() * resolution};
}

}  // namespace

std::optional<NearestObstacle> nearestObstacle(const StateMap& states, const Eigen::Vector3d& point,
                                               const ClassFilter& classes, double max_distance) {
  checkPoint(states.geometry(), point, [] { return std::string("the point"); });
  checkDistance(max_distance);
  return search(states, point, classes, max_distance);
}

void nearestObstacles(const StateMap& states, Span<const Eigen::Vector3d> points, const ClassFilter& classes,
                      double max_distance, Span<std::optional<NearestObstacle>> found) {
  if (found.size() != points.size()) {
    throw std::invalid_argument("there are " + std::to_string(points.size()) + " points and room for " +
                                std::to_string(found.size()) + " obstacles; give as much room as points");
  }
  for (std::size_t n = 0; n < points.size(); ++n) {
    checkPoint(states.geometry(), points[n], [&] { return "point " + std::to_string(n); });
  }
  checkDistance(max_distance);
  states.parallelFor((points.size() + kSearchesPerJob - 1) / kSearchesPerJob, [&](std::size_t job) {
    const std::size_t end = std::min(points.size(), (job + 1) * kSearchesPerJob);
    for (std::size_t n = job * kSearchesPerJob; n < end; ++n) {
      found[n] = search(states, points[n], classes, max_distance);
    }
  });
}

}  // namespace bki_mapping
