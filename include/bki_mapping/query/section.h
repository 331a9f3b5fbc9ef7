/// @file Sections through the map, as grids of states and labels.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "bki_mapping/query/state_map.h"

namespace bki_mapping {

/// A grid of square cells of the map's resolution. Cell (column, row) says what the voxel is at its centre.
struct Section {
  std::size_t width = 0, height = 0;  ///< columns and rows
  Eigen::Vector3d origin;             ///< corner of cell (0, 0) [m]
  Eigen::Vector3d right, up;          ///< unit vectors of rising columns and rows
  double resolution = 0.0;            ///< edge of a cell [m]
  std::vector<VoxelState> states;     ///< by row, columns fastest
  std::vector<ClassId> labels;        ///< likewise; kFreeClass where not occupied

  Eigen::Vector3d centreOf(std::size_t column, std::size_t row) const {
    return origin +
           resolution * ((static_cast<double>(column) + 0.5) * right + (static_cast<double>(row) + 0.5) * up);
  }
};

/// Sections of more cells are refused.
constexpr double kMostSectionCells = 1e8;

/// The layer of voxels at a height. Takes some 10 ns a cell.
/// @param z height [m]. @param area x and y [m]; the section has all voxels that overlap it.
/// @throws std::invalid_argument if a number is not finite, the area is inside out, or the section reaches
/// beyond the grid or is too large.
Section horizontalSection(const StateMap& states, double z, const Eigen::AlignedBox2d& area);

/// A vertical plane that stands on the line between two points, seen with `from` on the left.
/// @param from, to x and y [m]; must differ. @param min_z, max_z heights [m]; the section has all layers of
/// voxels between them. @throws std::invalid_argument likewise.
Section verticalSection(const StateMap& states, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                        double min_z, double max_z);

}  // namespace bki_mapping
