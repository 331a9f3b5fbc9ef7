/// @file Exports maps as PLY and PCD files.
#pragma once

#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/rules/voxel_state.h"

namespace bki_mapping {

/// One voxel of an exported map; docs/files.md describes the fields.
struct [[gnu::packed]] VoxelRecord {
  double x, y, z;  ///< centre, map frame [m]
  std::uint8_t red, green, blue;
  std::uint16_t label;  ///< class id; 255 unless occupied
  std::uint8_t state;   ///< VoxelState
  float probability, occupancy, class_probability, variance, entropy, evidence;  ///< as in VoxelView
};

/// Parses a list of states such as "occupied,free". @throws std::invalid_argument on an unknown word.
VoxelStates parseStates(const std::string& list);

/// The voxels in the given states, blocks in sorted order.
std::vector<VoxelRecord> collectVoxels(const SemanticMap& map, const StateRules& rules,
                                       const ClassTable& classes, const VoxelStates& states);

/// Exports a map; the file appears complete or not at all. The extension, .ply or .pcd, chooses the format
/// (both binary). Coordinates are float32; far from the origin, they are float64 in a PLY file, and in a PCD
/// file relative to its VIEWPOINT.
/// @throws std::invalid_argument on another extension, std::runtime_error if the file cannot be written.
void exportMap(const std::string& path, const SemanticMap& map, const StateRules& rules,
               const ClassTable& classes, const VoxelStates& states);
/// The origin of the coordinates in a PCD file of a map, which the file has as its VIEWPOINT: zero or, far
/// from it, a place in the map in whole kilometres [m].
Eigen::Vector3d pcdOrigin(const SemanticMap& map);
/// Checks the name of a file for a map before long work: a map file (isMapFileName), or one for exportMap.
/// @throws std::invalid_argument on another extension.
void checkMapName(const std::string& path);

}  // namespace bki_mapping
