/// @file Class tables from YAML files.
#pragma once

#include <string>

#include "bki_mapping/core/class_table.h"

namespace bki_mapping {

/// Reads a class table; docs/classes.md describes the format.
/// @param name_or_file a table of config/classes (its name without .yaml), or the path of a file.
/// @throws std::invalid_argument in one sentence: unknown name or file, invalid YAML, unknown key or bad
/// value.
ClassTable loadClassTable(const std::string& name_or_file);

}  // namespace bki_mapping
