/// @file The mapper's parameters by name.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/mapping/mapper_config.h"

namespace bki_mapping {

using Parameter = NamedParameter<MapperConfig>;

/// All parameters of the mapper, in the order in which they are documented.
std::vector<Parameter> mapperParameters();

/// Whether a mapper can take over another value of a parameter and keep its map.
bool changesWhileMapping(const std::string& name);

/// setNamedParameters with the mapper's parameters.
void setParameters(MapperConfig& config, const std::map<std::string, std::string>& values);

/// What a user should know about settings that are allowed, but hardly meant: a sentence each.
std::vector<std::string> settingWarnings(const MapperConfig& config);

}  // namespace bki_mapping
