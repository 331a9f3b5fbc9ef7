#include "bki_mapping/query/queries.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "query/voxel_rows.h"

namespace bki_mapping {
namespace {

/// @param low, high opposite corners of the section [m].
void check(const GridGeometry& geometry, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  if (!low.allFinite() || !high.allFinite()) {
    throw std::invalid_argument("the section has a coordinate that is not finite; give finite ones");
  }
  if (!geometry.contains(low) || !geometry.contains(high)) {
    throw std::invalid_argument("the section reaches beyond the map's grid; cut it to where the map is");
  }
}

/// Allocates and fills a section whose geometry is set, but for width and height.
Section filled(const StateMap& states, Section section, double width, double height) {
  if (width * height > kMostSectionCells) {
    throw std::invalid_argument("the section has " + std::to_string(width) + " x " + std::to_string(height) +
                                " cells; make it smaller, 100 million are the most");
  }
  section.width = static_cast<std::size_t>(width);
  section.height = static_cast<std::size_t>(height);
  section.states.resize(section.width * section.height);
  section.labels.resize(section.width * section.height);
  states.parallelFor(section.height, [&](std::size_t row) {
    BlockReader reader(states);
    for (std::size_t column = 0; column < section.width; ++column) {
      const VoxelIndex voxel = states.geometry().voxelAt(section.centreOf(column, row));
      const BlockStates* const block = reader.find(GridGeometry::blockOf(voxel));
      const int offset = GridGeometry::offsetInBlock(voxel);
      const std::size_t cell = row * section.width + column;
      section.states[cell] = block ? block->state(offset) : VoxelState::kUnknown;
      section.labels[cell] = block ? block->labels[static_cast<std::size_t>(offset)] : kFreeClass;
    }
  });
  return section;
}

}  // namespace

Section horizontalSection(const StateMap& states, double z, const Eigen::AlignedBox2d& area) {
  const GridGeometry& geometry = states.geometry();
  const double resolution = geometry.resolution();
  check(geometry, {area.min().x(), area.min().y(), z}, {area.max().x(), area.max().y(), z});
  if ((area.min().array() > area.max().array()).any()) {
    throw std::invalid_argument("the section's area is inside out; give a min below its max");
  }
  const VoxelRange x = overlapped(area.min().x() / resolution, area.max().x() / resolution),
                   y = overlapped(area.min().y() / resolution, area.max().y() / resolution);
  Section section;
  section.resolution = resolution;
  section.right = Eigen::Vector3d::UnitX();
  section.up = Eigen::Vector3d::UnitY();
  section.origin = Eigen::Vector3d(x.begin, y.begin, geometry.voxelAt({0.0, 0.0, z}).z + 0.5) * resolution;
  return filled(states, section, x.end - x.begin, y.end - y.begin);
}

Section verticalSection(const StateMap& states, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                        double min_z, double max_z) {
  const double resolution = states.geometry().resolution();
  check(states.geometry(), {from.x(), from.y(), min_z}, {to.x(), to.y(), max_z});
  const double length = (to - from).norm();
  if (!(length > 0.0)) {
    throw std::invalid_argument("the section stands on two points that are the same; give two that differ");
  }
  if (min_z > max_z)
    throw std::invalid_argument("the section's heights are inside out; give min_z below max_z");
  const VoxelRange z = overlapped(min_z / resolution, max_z / resolution);
  Section section;
  section.resolution = resolution;
  section.right << (to - from) / length, 0.0;
  section.up = Eigen::Vector3d::UnitZ();
  section.origin << from, z.begin * resolution;
  return filled(states, section, std::ceil(length / resolution), z.end - z.begin);
}

}  // namespace bki_mapping
