/// @file Class tables and parameters from YAML files.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/mapping/mapper_config.h"

namespace bki_mapping {

/// The names of the tables of config/classes, sorted.
std::vector<std::string> classTableNames();

/// The path of the file that loadClassTable() reads. @throws std::invalid_argument if there is none.
std::string classTableFile(const std::string& name_or_file);

/// Reads a class table; docs/classes.md describes the format.
/// @param name_or_file a table of config/classes (its name without .yaml), or the path of a file.
/// @throws std::invalid_argument in one sentence: unknown name or file, invalid YAML, unknown key or bad
/// value.
ClassTable loadClassTable(const std::string& name_or_file);

/// Reads a YAML file of nested maps into a flat map: names joined by `/`, values as text.
/// @param name_or_file a preset of config/presets (its name without .yaml), or the path of a file.
/// @throws std::invalid_argument in one sentence: unknown name or file, invalid YAML (see yaml_file.h), a
/// value that is a list, or a name that occurs twice.
std::map<std::string, std::string> loadParameterFile(const std::string& name_or_file);

/// The same for the text of such a file, as parameterYaml returns it. @throws std::invalid_argument as above,
/// but without the name of a file.
std::map<std::string, std::string> parseParameters(const std::string& yaml);

/// The mapper's parameters as such a file, with the meaning, allowed values and unit of each as a comment.
std::string parameterYaml(const MapperConfig& config);

}  // namespace bki_mapping
