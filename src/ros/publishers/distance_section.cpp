#include <nav_msgs/OccupancyGrid.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "bki_mapping/query/distance_field.h"
#include "ros/map_publisher.h"
#include "ros/sentence_throttle.h"

namespace bki_mapping::ros_interface {
namespace {

/// The voxels of the field that a message is made of.
struct SectionRegion {
  Eigen::AlignedBox3d field;  ///< with all obstacles that count [m]
  VoxelIndex min;             ///< first voxel of the section
  std::uint32_t edge;         ///< [voxels]
};

/// Publishes a horizontal section of the distances to obstacles around the sensor.
class DistanceSection : public MapPublisher {
 public:
  explicit DistanceSection(const PublisherContext& context) {
    publisher_ = context.advertiseWhole<nav_msgs::OccupancyGrid>("distance_section", *this);
  }

  void rest() override {
    MapPublisher::rest();
    field_.reset();  // frees its memory
  }

 private:
  void publishNew(const ServerSnapshot& snapshot) override {
    const DistanceSectionConfig& config = snapshot.config.distance_section;
    const GridGeometry& geometry = snapshot.map.geometry();
    const std::optional<SectionRegion> region = regionOf(config, geometry, snapshot.sensor);
    if (!region) return field_.reset();  // it would miss what changes meanwhile
    const StateMap states(snapshot.map, snapshot.rules, snapshot.threadsFor(snapshot.map.size()));
    bring(states, region->field, obstaclesOf(config, snapshot.classes));
    publisher_.publish(message(snapshot, states, *region));
  }

  /// The section, which moves with the sensor by whole blocks, so that a sensor that hardly moves needs the
  /// same field. @return nothing if it is too large, or beyond the grid.
  std::optional<SectionRegion> regionOf(const DistanceSectionConfig& config, const GridGeometry& geometry,
                                        const Eigen::Vector3d& sensor) {
    const double resolution = geometry.resolution();
    const Eigen::Vector3d centre = sensor + Eigen::Vector3d(0.0, 0.0, config.height);
    const double half = config.range + 0.5 * geometry.blockSize(), reach = config.max_distance;
    const double voxels =
        std::pow(2.0 * (half + reach) / resolution + kBlockEdge, 2) * (2.0 * reach / resolution + 3.0);
    if (voxels > kMostVoxels) {
      warn("its distances would be those of " + numberText(std::round(voxels)) +
           " voxels, too many; lower distance_section/range or distance_section/max_distance");
      return std::nullopt;
    }
    const double farthest = GridGeometry::kMaxCoordinate * resolution;
    if (centre.cwiseAbs().maxCoeff() + half + reach + geometry.blockSize() > farthest) {
      warn("the sensor is at the end of the map's grid");
      return std::nullopt;
    }
    const VoxelIndex at = geometry.voxelAt(centre);
    const BlockIndex block = GridGeometry::blockOf(at);
    const auto blocks = static_cast<std::int32_t>(std::ceil(config.range / geometry.blockSize()));
    SectionRegion region;
    region.min = {{(block.x - blocks) * kBlockEdge, (block.y - blocks) * kBlockEdge, at.z}};
    region.edge = static_cast<std::uint32_t>(2 * blocks + 1) * kBlockEdge;
    const Eigen::Vector3d low = geometry.voxelCentre(region.min),
                          size = Eigen::Vector3d(region.edge - 1.0, region.edge - 1.0, 0.0) * resolution,
                          margin = Eigen::Vector3d::Constant(reach);
    region.field = {low - margin, low + size + margin};
    return region;
  }

  /// Makes the field that of a region.
  void bring(const StateMap& states, const Eigen::AlignedBox3d& region, const ObstacleRules& rules) {
    if (!field_ || !(field_->rules() == rules)) {
      field_.reset();
      field_ = std::make_unique<DistanceField>(states, region, rules);
    } else if (changed.all() || region.min() != region_.min() || region.max() != region_.max() ||
               manyChangedIn(states.geometry(), region)) {
      field_->compute(states, region);
    } else {
      field_->update(states, changed.blocks());
    }
    region_ = region;
  }

  /// Whether so many blocks of a region have changed that computing all of it is faster than an update.
  bool manyChangedIn(const GridGeometry& geometry, const Eigen::AlignedBox3d& region) const {
    constexpr double kMany = 0.06;  // docs/queries.md has times
    const double blocks = region.volume() / std::pow(geometry.blockSize(), 3);
    const auto inside =
        std::count_if(changed.blocks().begin(), changed.blocks().end(),
                      [&](const GridIndex& block) { return region.contains(geometry.blockCentre({block})); });
    return static_cast<double>(inside) > kMany * blocks;
  }

  nav_msgs::OccupancyGrid message(const ServerSnapshot& snapshot, const StateMap& states,
                                  const SectionRegion& region) const {
    const GridGeometry& geometry = snapshot.map.geometry();
    nav_msgs::OccupancyGrid grid;
    grid.header = snapshot.header;
    grid.info.map_load_time = snapshot.header.stamp;
    grid.info.resolution = static_cast<float>(geometry.resolution());
    grid.info.width = grid.info.height = region.edge;
    grid.info.origin.orientation.w = 1.0;
    const Eigen::Vector3d centre = geometry.voxelCentre(region.min);
    grid.info.origin.position.x = centre.x() - 0.5 * geometry.resolution();
    grid.info.origin.position.y = centre.y() - 0.5 * geometry.resolution();
    grid.info.origin.position.z = centre.z();
    grid.data.reserve(std::size_t{region.edge} * region.edge);
    BlockReader reader(states);
    const auto edge = static_cast<std::int32_t>(region.edge);
    const auto most = static_cast<float>(snapshot.config.distance_section.max_distance);
    for (std::int32_t y = 0; y < edge; ++y) {
      for (std::int32_t x = 0; x < edge; ++x) {
        const VoxelIndex voxel = {{region.min.x + x, region.min.y + y, region.min.z}};
        const float distance = field_->distance(voxel);
        const BlockStates* const block = reader.find(GridGeometry::blockOf(voxel));
        const VoxelState state =
            block ? block->state(GridGeometry::offsetInBlock(voxel)) : VoxelState::kUnknown;
        const bool known = state == VoxelState::kFree || state == VoxelState::kOccupied;
        grid.data.push_back(known || distance <= 0.0f ? nearness(distance, most) : kUnknown);
      }
    }
    return grid;
  }

  /// 100 in obstacles, 99 next to them, and falling to 0 at `most`.
  static std::int8_t nearness(float distance, float most) {
    if (distance <= 0.0f) return 100;
    return static_cast<std::int8_t>(std::lround(99.0f * std::max(0.0f, 1.0f - distance / most)));
  }

  void warn(const std::string& why) {
    if (throttle_.allow(why, SentenceThrottle::Clock::now())) {
      ROS_WARN("%s is not published: %s", topic().c_str(), why.c_str());
    }
  }

  static constexpr std::int8_t kUnknown = -1;
  /// Of a field, which takes 12 bytes a voxel.
  static constexpr double kMostVoxels = 1e7;

  std::unique_ptr<DistanceField> field_;  // in an optional, GCC 14 takes it for uninitialized
  Eigen::AlignedBox3d region_;            ///< of field_
  SentenceThrottle throttle_;
};

}  // namespace

std::unique_ptr<MapPublisher> makeDistanceSection(const PublisherContext& context) {
  return std::make_unique<DistanceSection>(context);
}

}  // namespace bki_mapping::ros_interface
