/// @file What the map says at points.
#pragma once

#include <Eigen/Core>

#include "bki_mapping/core/span.h"
#include "bki_mapping/query/state_map.h"

namespace bki_mapping {

/// Arrays to be filled with the fields of VoxelView, each as long as the points; nullptr: not wanted.
struct PointValues {
  VoxelState* states = nullptr;
  ClassId* labels = nullptr;
  float* occupancy = nullptr;
  float* class_probability = nullptr;
  float* probability = nullptr;
  float* variance = nullptr;
};

/// Reads the voxels that contain the points; the values are those of viewPoint. Points beyond the grid's last
/// voxel are unknown. States and labels cost about as much as a lookup, the other fields a pass over the
/// classes of the block; sorted points are faster than scattered ones. docs/queries.md has figures.
/// @param points map frame [m].
/// @throws std::invalid_argument if a coordinate is not finite; the arrays may then be partly filled.
void readPoints(const StateMap& states, Span<const Eigen::Vector3d> points, const PointValues& values);
void readPoints(const StateMap& states, Span<const Eigen::Vector3f> points, const PointValues& values);

}  // namespace bki_mapping
