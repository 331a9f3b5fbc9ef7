/// @file Exports maps to files of every format; the ending chooses.
#pragma once

#include <string>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/query/column_map.h"
#include "bki_mapping/rules/voxel_state.h"
#include "export/html_export.h"

namespace bki_mapping {

struct ExportOptions {
  VoxelStates states{VoxelState::kOccupied};  ///< of the voxels in .ply and .pcd files
  ColumnRules columns;                        ///< of .yaml files
  HtmlOptions html;                           ///< of .html files
  bool mesh = false;                          ///< .ply files hold faces, not points
};

/// Checks a name before long work. @throws std::invalid_argument if it has none of the endings .ply, .pcd,
/// .ot, .bt, .yaml, .glb and .html; std::runtime_error if the file, or the image of a .yaml, cannot be
/// written, or three.js for a .html is missing.
void checkExport(const std::string& path, const ExportOptions& options = {});

/// Writes a map by exportMap, exportOctoMap, exportGrid, exportMesh or exportHtml. @throws as these and
/// checkExport().
void exportFile(const std::string& path, const SemanticMap& map, const StateRules& rules,
                const ClassTable& classes, const ExportOptions& options);

/// The zero of heights. @param word `map` or `ground`. @throws std::invalid_argument on another word.
HeightReference parseHeightReference(const std::string& word);

}  // namespace bki_mapping
