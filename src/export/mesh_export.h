/// @file Exports a map as a mesh, for Blender, MeshLab and other viewers of glTF.
#pragma once

#include <string>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/rules/state_rules.h"

namespace bki_mapping {

/// Writes the open faces of the occupied voxels (openFaces) as triangles.
///
/// .glb: binary glTF 2.0, with one material for each class, which has the class's name and colour. glTF's y
/// axis points up, so the node of the mesh is turned: its local frame is the map frame [m], shifted by the
/// node's translation where floats would be too coarse. .ply: triangles with colours, in the map frame [m];
/// coordinates are float32, or float64 where floats would be too coarse.
/// @throws std::runtime_error if the file cannot be written, std::invalid_argument on another ending, or if
/// the mesh would exceed 4 GB.
void exportMesh(const std::string& path, const SemanticMap& map, const StateRules& rules,
                const ClassTable& classes);

/// Checks the name of a mesh before long work. @throws std::invalid_argument if it does not end in .glb or
/// .ply.
void checkMeshName(const std::string& path);

}  // namespace bki_mapping
