/// @file Exports maps as OctoMaps.
#pragma once

#include <string>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/rules/state_rules.h"

namespace bki_mapping {

/// Writes the occupied and the free voxels as an octree by AtomicFile. The extension chooses: .bt, an OcTree
/// that knows only occupied and free; .ot, a ColorOcTree with the colour of the class of each occupied voxel,
/// and log-odds of VoxelView::occupancy within OctoMap's limits, whose sign agrees with the state. Only equal
/// voxels of the same colour are merged.
/// @throws std::invalid_argument on another extension, or if the map reaches beyond the 2^15 voxels from its
/// origin that an octree can hold; std::runtime_error if the file cannot be written.
void exportOctoMap(const std::string& path, const SemanticMap& map, const StateRules& rules,
                   const ClassTable& classes);

}  // namespace bki_mapping
