/// @file Parameters from YAML files.
#pragma once

#include <map>
#include <string>

#include "bki_mapping/mapping/mapper_config.h"

namespace bki_mapping {

/// Reads a YAML file of nested maps into a flat map: names joined by `/`, values as text.
/// @throws std::invalid_argument in one sentence: no such file, invalid YAML (see yaml_file.h), a value that
/// is a list, or a name that occurs twice.
std::map<std::string, std::string> loadParameterFile(const std::string& file);

/// The same for the text of such a file, as parameterYaml returns it. @throws std::invalid_argument as above,
/// but without the name of a file.
std::map<std::string, std::string> parseParameters(const std::string& yaml);

/// The mapper's parameters as such a file, with the meaning, allowed values and unit of each as a comment.
std::string parameterYaml(const MapperConfig& config);

}  // namespace bki_mapping
