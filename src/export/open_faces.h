/// @file The surface of what is occupied in a map: the faces of voxels that show.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <vector>

#include "bki_mapping/map/semantic_map.h"
#include "bki_mapping/rules/state_rules.h"

namespace bki_mapping {

/// Faces of voxels of one class, each two triangles, counterclockwise as seen from outside. Faces of a block
/// share their corners.
struct Faces {
  std::vector<Eigen::Vector3f> corners;
  std::vector<std::uint32_t> triangles;  ///< three corners each
  Eigen::AlignedBox3f box;               ///< of the corners

  std::uint64_t bytes() const {
    return sizeof(Eigen::Vector3f) * corners.size() + sizeof(std::uint32_t) * triangles.size();
  }
};

/// The open faces of the occupied voxels by their class: those towards voxels that are not occupied.
/// @param origin of the corners, in the map frame [m].
/// @param most_bytes of all faces; @throws std::length_error if they take more.
std::map<ClassId, Faces> openFaces(const SemanticMap& map, const StateRules& rules,
                                   const Eigen::Vector3d& origin, std::uint64_t most_bytes);

}  // namespace bki_mapping
