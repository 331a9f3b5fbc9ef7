/// @file Exports the map as seen from above, for map_server.
#pragma once

#include <string>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/query/column_map.h"
#include "bki_mapping/rules/state_rules.h"

namespace bki_mapping {

/// Writes the occupancy of all columns, as the topic projected_map has it, as the two files that map_server
/// reads: a YAML file, and beside it an image, PGM, with the same name. Free cells are 254, occupied ones 0,
/// unknown ones 205.
/// @param path of the YAML file, ending in .yaml. @throws std::runtime_error if a file cannot be written,
/// std::invalid_argument if the image would have more than 2^28 cells.
void exportGrid(const std::string& path, const SemanticMap& map, const StateRules& rules,
                const ClassTable& classes, const ColumnRules& column_rules);

/// The image of a YAML file.
std::string gridImagePath(const std::string& path);

}  // namespace bki_mapping
