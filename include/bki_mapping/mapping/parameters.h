/// @file The mapper's parameters by name.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/mapping/mapper_config.h"

namespace bki_mapping {

using Parameter = NamedParameter<MapperConfig>;

/// All parameters of the mapper, in the order in which they are documented. Those of a component stand in
/// its room, in `*_parameters.h` beside the code that reads them.
std::vector<Parameter> mapperParameters();

/// setNamedParameters with the mapper's parameters.
void setParameters(MapperConfig& config, const std::map<std::string, std::string>& values);

/// checkNamedParameters with the mapper's parameters.
void checkParameters(const MapperConfig& config);

/// @throws std::invalid_argument that names a parameter that differs, but can change only at the start.
void checkChanges(const MapperConfig& before, const MapperConfig& after);

/// What a user should know about settings that are allowed, but hardly meant: a sentence each.
std::vector<std::string> settingWarnings(const MapperConfig& config);

}  // namespace bki_mapping
