/// @file Class tables from YAML files.
#pragma once

#include <string>

#include "bki_mapping/core/class_table.h"

namespace bki_mapping {

/// Reads a class table. The file's form is described in docs/classes.md.
/// @param name_or_file a name of config/classes (without .yaml), or the path of a file.
/// @throws std::invalid_argument in one sentence: no such name or file, bad YAML, unknown key, bad value.
ClassTable loadClassTable(const std::string& name_or_file);

}  // namespace bki_mapping
