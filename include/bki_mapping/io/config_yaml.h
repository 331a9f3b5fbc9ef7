/// @file Parameters from YAML files.
#pragma once

#include <map>
#include <string>

#include "bki_mapping/mapping/mapper_config.h"

namespace bki_mapping {

/// Reads a YAML file of nested maps as names with `/` between the parts, and values as text.
/// @throws std::invalid_argument in one sentence: no such file, bad YAML (see yaml_file.h), a value that is a
/// list, a name given twice.
std::map<std::string, std::string> loadParameterFile(const std::string& file);

/// The mapper's settings as such a file, each with its meaning, values and unit as a comment.
std::string parameterYaml(const MapperConfig& config);

}  // namespace bki_mapping
