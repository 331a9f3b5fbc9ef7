/// @file The voxels of blocks as points: the data of map files and of the topics with clouds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "bki_mapping/export/map_export.h"
#include "bki_mapping/rules/state_rules.h"
#include "parallel/thread_pool.h"

namespace bki_mapping {

/// One voxel in PCD files and in the topics voxel_cloud and voxel_cloud_updates, as it lies in memory.
struct [[gnu::packed]] VoxelPoint {
  float x, y, z;      ///< centre, relative to an origin [m]
  std::uint32_t rgb;  ///< as PCL packs it: red in bits 16 to 23, green, blue
  std::uint16_t label;
  std::uint8_t state;
  float probability, occupancy, class_probability, variance, entropy, evidence;
};

/// A field of VoxelPoint.
struct VoxelField {
  /// By the numbers of pcl::PCLPointField and sensor_msgs/PointField.
  enum Type : std::uint8_t { kUint8 = 2, kUint16 = 4, kFloat32 = 7 };

  const char* name;
  Type type;
  std::uint32_t offset;  ///< in the point [bytes]

  constexpr std::size_t bytes() const { return type == kFloat32 ? 4 : type == kUint16 ? 2 : 1; }
};
/// The fields of VoxelPoint; rgb is declared as a float32, as PCL does.
inline constexpr std::array kVoxelFields = {
    VoxelField{"x", VoxelField::kFloat32, offsetof(VoxelPoint, x)},
    VoxelField{"y", VoxelField::kFloat32, offsetof(VoxelPoint, y)},
    VoxelField{"z", VoxelField::kFloat32, offsetof(VoxelPoint, z)},
    VoxelField{"rgb", VoxelField::kFloat32, offsetof(VoxelPoint, rgb)},
    VoxelField{"label", VoxelField::kUint16, offsetof(VoxelPoint, label)},
    VoxelField{"state", VoxelField::kUint8, offsetof(VoxelPoint, state)},
    VoxelField{"probability", VoxelField::kFloat32, offsetof(VoxelPoint, probability)},
    VoxelField{"occupancy", VoxelField::kFloat32, offsetof(VoxelPoint, occupancy)},
    VoxelField{"class_probability", VoxelField::kFloat32, offsetof(VoxelPoint, class_probability)},
    VoxelField{"variance", VoxelField::kFloat32, offsetof(VoxelPoint, variance)},
    VoxelField{"entropy", VoxelField::kFloat32, offsetof(VoxelPoint, entropy)},
    VoxelField{"evidence", VoxelField::kFloat32, offsetof(VoxelPoint, evidence)},
};

/// A VoxelRecord with float32 coordinates.
struct [[gnu::packed]] FloatVoxelRecord {
  float x, y, z;  ///< centre, map frame [m]
  std::uint8_t red, green, blue;
  std::uint16_t label;
  std::uint8_t state;
  float probability, occupancy, class_probability, variance, entropy, evidence;
};

/// Which voxels become points.
struct VoxelSelection {
  VoxelStates states;
  double min_z = -std::numeric_limits<double>::infinity();  ///< lowest height of a centre [m]
  double max_z = std::numeric_limits<double>::infinity();   ///< greatest [m]
};

/// The selected voxels of blocks. They are counted first, and then written where the caller wants them, so
/// that no copy lies in between.
class VoxelPoints {
 public:
  using Blocks = std::vector<std::pair<BlockIndex, const Block*>>;

  /// Counts. @param map, rules, classes, pool, and the blocks: must not change, and outlive this.
  VoxelPoints(const SemanticMap& map, const StateRules& rules, const ClassTable& classes,
              const VoxelSelection& selection, Blocks blocks, ThreadPool& pool);

  std::size_t count() const { return begin_.back(); }
  /// Writes all points, in the order of the blocks, by offset within each. @param to memory for count()
  /// points, of any alignment. @param origin of the coordinates, map frame [m].
  void write(VoxelPoint* to, const Eigen::Vector3d& origin) const { writeAs(to, origin); }
  void write(VoxelRecord* to) const { writeAs(to, Eigen::Vector3d::Zero()); }
  void write(FloatVoxelRecord* to) const { writeAs(to, Eigen::Vector3d::Zero()); }

 private:
  template <typename Point>
  void writeAs(Point* to, const Eigen::Vector3d& origin) const;
  template <typename Point>
  void writeBlock(std::size_t block, Point* to, const Eigen::Vector3d& origin) const;
  /// Calls job(position in blocks_) for each block, on the pool's threads.
  template <typename Job>
  void forEachBlock(const Job& job) const;
  /// Calls visit(offset) for each selected voxel of a block.
  template <typename Visit>
  void forEachSelected(const BlockIndex& index, const BlockView& view, const Visit& visit) const;

  const SemanticMap& map_;
  const StateRules& rules_;
  const ClassTable& classes_;
  VoxelSelection selection_;
  Blocks blocks_;
  ThreadPool& pool_;
  std::vector<std::size_t> begin_;  ///< the first point of each block; last, the number of all
};

/// The place that decides the origin of a cloud of voxels [m]: the middle block of a sorted list, which a few
/// wrong poses do not move; zero without blocks.
Eigen::Vector3d placeOf(const GridGeometry& geometry, const VoxelPoints::Blocks& blocks);

}  // namespace bki_mapping
